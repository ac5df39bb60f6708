// What of the home is on the screen: moved by wheel, drag, pinch, buttons and keys.

const MOST_ZOOM = 60;  // times the whole home
const TAP_PX = 6;  // that a finger or mouse moves in a click

class Viewport {
  constructor() {
    this.width = this.height = this.scale = 1;
    this.x = this.y = 0;  // middle of the screen, in the home
    this.box = null;
    this.isWhole = true;
  }

  // Shows a whole home: left, bottom, right, top.
  fit(box = this.box) {
    this.box = box;
    if (!box) return;
    const [left, bottom, right, top] = box;
    this.whole = 0.92 * Math.min(this.width / Math.max(right - left, 1e-6), this.height / Math.max(top - bottom, 1e-6));
    this.scale = this.whole;
    [this.x, this.y] = [(left + right) / 2, (bottom + top) / 2];
    this.isWhole = true;
  }

  resize(width, height) {
    if (width === this.width && height === this.height) return;
    [this.width, this.height] = [width, height];
    if (this.isWhole) this.fit();
  }

  toScreen([x, y]) {
    return [(x - this.x) * this.scale + this.width / 2, this.height / 2 - (y - this.y) * this.scale];
  }

  toHome([x, y]) {
    return [(x - this.width / 2) / this.scale + this.x, (this.height / 2 - y) / this.scale + this.y];
  }

  // Zooms so that what is at a point of the screen stays there.
  zoom(factor, at = [this.width / 2, this.height / 2]) {
    const [x, y] = this.toHome(at);
    this.scale = Math.min(Math.max(this.scale * factor, this.whole / 2), this.whole * MOST_ZOOM);
    const [nowX, nowY] = this.toHome(at);
    this.x += x - nowX;
    this.y += y - nowY;
    this.isWhole = false;
  }

  move(right, down) {
    this.x -= right / this.scale;
    this.y += down / this.scale;
    this.isWhole = false;
  }

  // Moves, and zooms out, until points of the home are on the screen.
  reveal(points) {
    const isIn = points.every(point => {
      const [x, y] = this.toScreen(point);
      return x > 40 && y > 40 && x < this.width - 40 && y < this.height - 40;
    });
    if (isIn || !points.length) return;
    const [xs, ys] = [0, 1].map(axis => points.map(point => point[axis]));
    this.x = (Math.min(...xs) + Math.max(...xs)) / 2;
    this.y = (Math.min(...ys) + Math.max(...ys)) / 2;
    const wide = Math.max(...xs) - Math.min(...xs), tall = Math.max(...ys) - Math.min(...ys);
    this.scale = Math.min(this.scale, 0.7 * this.width / Math.max(wide, 1e-6), 0.7 * this.height / Math.max(tall, 1e-6));
    this.isWhole = false;
  }
}

// Listens to a canvas; `tap` and `hover` get a point on it and how wide a finger or mouse aims.
const listenToMap = (canvas, viewport, redraw, tap, hover) => {
  const fingers = new Map();
  let moved = 0;
  const locate = event => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  const getReach = event => event.pointerType === "mouse" ? 14 : 24;
  const spread = () => {
    const [one, other] = [...fingers.values()];
    return {size: Math.hypot(one[0] - other[0], one[1] - other[1]), at: [(one[0] + other[0]) / 2, (one[1] + other[1]) / 2]};
  };
  canvas.addEventListener("pointerdown", event => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, locate(event));
    if (fingers.size === 1) moved = 0;
  });
  canvas.addEventListener("pointermove", event => {
    const at = locate(event), before = fingers.get(event.pointerId);
    if (!before) return hover(at, getReach(event));
    const pinch = fingers.size === 2 ? spread() : null;
    moved += Math.hypot(at[0] - before[0], at[1] - before[1]);
    fingers.set(event.pointerId, at);
    if (pinch) {
      const now = spread();
      viewport.zoom(now.size / Math.max(pinch.size, 1), now.at);
      viewport.move(now.at[0] - pinch.at[0], now.at[1] - pinch.at[1]);
      moved = Infinity;
    } else if (moved > TAP_PX) {
      viewport.move(at[0] - before[0], at[1] - before[1]);
    } else return;
    hover(null);
    redraw();
  });
  const end = event => {
    if (!fingers.delete(event.pointerId)) return;
    if (event.type === "pointerup" && moved <= TAP_PX && !fingers.size) tap(locate(event), getReach(event));
  };
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", end);
  canvas.addEventListener("pointerleave", () => hover(null));
  canvas.addEventListener("wheel", event => {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 30 : 1;
    viewport.zoom(Math.exp(-Math.min(Math.max(event.deltaY * lines, -300), 300) / 600), locate(event));
    redraw();
  }, {passive: false});
};
