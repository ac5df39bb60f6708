// The map: rooms, furniture, things, looks, the answer and the way of a search, drawn on a canvas.

const NAMES = ["paper", "ground", "ink", "muted", "line", "wall", "box", "belief", "route", "truth", "look",
  "fresh", "old", "missing", "change"];
const SMALLEST = 0.01;  // probability that is written down
const SHORT = 9;  // letters of a name that finds no room
const SMALLEST_DOT = 1.6, LARGEST_DOT = 5;  // pixels
const THING_METRES = 0.06;  // of the dot of a thing whose position is known, from its middle
const FAINTEST = 0.1;  // of what has been missing for days: it is drawn no more
const LIKELY = 0.05, SMALL_PX = 24;
const LEAST_PX = 9;  // of furniture with a name of its own

const readColours = () => {
  const style = getComputedStyle(document.documentElement);
  return Object.fromEntries(NAMES.map(name => [name, style.getPropertyValue(`--${name}`).trim()]));
};

const readHex = colour => [1, 3, 5].map(at => parseInt(colour.slice(at, at + 2), 16));

// A colour on the way from one to another.
const mix = (one, other, share) => {
  const [from, to] = [readHex(one), readHex(other)];
  return `rgb(${from.map((part, axis) => Math.round(part + (to[axis] - part) * share)).join()})`;
};

const sayShare = p => p < 0.01 ? "<1%" : `${Math.round(100 * p)}%`;

const getBounds = points => {
  const [xs, ys] = [0, 1].map(axis => points.map(point => point[axis]));
  return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
};

const isInside = (poly, [x, y]) => {
  let inside = false;
  poly.forEach(([x1, y1], row) => {
    const [x2, y2] = poly[(row + 1) % poly.length];
    if (y1 > y !== y2 > y && x < (x2 - x1) * (y - y1) / (y2 - y1) + x1) inside = !inside;
  });
  return inside;
};

const getDistance = (poly, [x, y]) => isInside(poly, [x, y]) ? 0 : Math.min(...poly.map(([x1, y1], row) => {
  const [x2, y2] = poly[(row + 1) % poly.length], wide = x2 - x1, tall = y2 - y1;
  const share = Math.min(Math.max(((x - x1) * wide + (y - y1) * tall) / (wide * wide + tall * tall || 1), 0), 1);
  return Math.hypot(x - x1 - share * wide, y - y1 - share * tall);
}));

class HomeMap {
  constructor(canvas, viewport, time) {
    [this.canvas, this.viewport, this.time] = [canvas, viewport, time];
    this.pen = canvas.getContext("2d");
    this.widths = new Map();
    this.labels = [];  // what is written, with its boxes
    this.drawMs = 0;
    canvas.homeMap = this;
  }

  // `shown`: state, answer, names, selected (furniture id), change, showsSearch, showsTruth.
  show(shown) {
    const {state, names} = this.shown = shown;
    this.plan = state.plan;
    this.byId = new Map(this.plan.furniture.map((own, row) => [own.id, row]));
    this.things = this.plan.furniture.map(() => []);
    const {place, relations, name, seen, there, at: points} = state.things;
    place.forEach((at, row) => {
      const isThere = there[row] === 1, strength = this.getFreshness(seen[row], 24);
      if (isThere || strength > FAINTEST) {
        const furniture = Math.floor(at / relations.length), [adverb, isInside] = relations[at % relations.length];
        const point = this.plan.furniture[furniture]?.toScale ? points[row] : null;
        this.things[furniture]?.push({name: names[name[row]], adverb, isInside, seen: seen[row], isThere, strength, point});
      }
    });
    for (const own of this.things) own.sort((one, other) => other.isInside - one.isInside);
    this.draw();
  }

  getExtent() {
    return getBounds([...this.plan.rooms, ...this.plan.furniture].flatMap(one => one.poly));
  }

  getMiddle(row) {
    return this.plan.furniture[row].inside.slice(0, 2);
  }

  draw() {
    if (!this.shown) return;
    const begin = performance.now(), {canvas, pen, viewport} = this;
    const ratio = devicePixelRatio || 1, wide = Math.round(viewport.width * ratio), tall = Math.round(viewport.height * ratio);
    if (canvas.width !== wide || canvas.height !== tall) [canvas.width, canvas.height] = [wide, tall];
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.colours = readColours();
    this.font = getComputedStyle(canvas).fontFamily;
    pen.fillStyle = this.colours.paper;
    pen.fillRect(0, 0, viewport.width, viewport.height);
    this.shapes = this.plan.furniture.map(own => own.poly.map(point => viewport.toScreen(point)));
    this.bounds = this.shapes.map(getBounds);
    this.isSeen = this.bounds.map(bounds => this.isOnScreen(bounds));
    this.dots = [];
    this.drawRooms();
    this.drawLooks();
    this.drawFurniture();
    this.drawThings();
    this.drawMarks();
    this.drawLabels();
    this.drawMs = performance.now() - begin;
  }

  trace(points) {
    this.pen.beginPath();
    for (const [x, y] of points) this.pen.lineTo(x, y);
    this.pen.closePath();
  }

  // The size of what is drawn around a point is not known: its corners are round.
  traceRound([left, top, right, bottom]) {
    this.pen.beginPath();
    this.pen.roundRect(left, top, right - left, bottom - top, Math.min(right - left, bottom - top) / 3);
  }

  drawRooms() {
    const {pen, colours} = this;
    this.roomBounds = this.plan.rooms.map(room => {
      const points = room.poly.map(point => this.viewport.toScreen(point));
      this.trace(points);
      pen.globalAlpha = 0.13;
      pen.fillStyle = room.colour;
      pen.fill();
      pen.globalAlpha = 1;
      if (room.known) {
        pen.lineWidth = 2;
        pen.strokeStyle = colours.wall;
        pen.stroke();
      }
      return getBounds(points);
    });
    for (const door of this.plan.doors) {
      const [x, y] = this.viewport.toScreen(door);
      pen.beginPath();
      pen.arc(x, y, Math.min(Math.max(0.3 * this.viewport.scale, 3), 9), 0, 7);
      pen.fillStyle = colours.paper;
      pen.fill();
      pen.lineWidth = 1.2;
      pen.strokeStyle = colours.wall;
      pen.stroke();
    }
  }

  // How fresh something is: 1 in this step, half after so many hours, or steps without a clock.
  getFreshness(step, hours = 6) {
    return 0.5 ** ((this.shown.state.step - step) / this.time.toSteps(hours * HOUR, hours));
  }

  drawLooks() {
    const {pen, colours, viewport} = this;
    pen.fillStyle = colours.look;
    for (const look of this.shown.state.looks) {
      const isNow = look.step === this.shown.state.step;
      if (look.cone) {
        this.trace(look.cone.map(point => viewport.toScreen(point)));
        pen.globalAlpha = 0.16;
        pen.fill();
      }
      const at = look.cone ? look.cone[0] : look.at;
      if (!at) continue;
      pen.globalAlpha = isNow ? 1 : 0.06 + 0.5 * this.getFreshness(look.step);
      pen.beginPath();
      pen.arc(...viewport.toScreen(at), isNow ? 5 : 3, 0, 7);
      pen.fill();
    }
    pen.globalAlpha = 1;
  }

  drawFurniture() {
    const {pen, colours, shown} = this, {state, answer, selected} = shown;
    const now = new Set(state.looks.filter(look => look.step === state.step).map(look => look.furniture));
    this.plan.furniture.forEach((own, row) => {
      if (!this.isSeen[row]) return;
      const p = answer?.probability?.[row] ?? 0, isFloor = own.name === "floor" && own.toScale;
      if (own.toScale || !this.plan.hasPositions) this.trace(this.shapes[row]);
      else this.traceRound(this.bounds[row]);
      pen.globalAlpha = isFloor ? 0.7 * p : 1;
      pen.fillStyle = isFloor ? colours.belief : mix(colours.box, colours.belief, Math.sqrt(p));
      pen.fill();
      pen.globalAlpha = 1;
      const last = state.lastLook[row] ?? -1, isNow = now.has(row), isChosen = own.id === selected;
      if (isFloor && !isNow && !isChosen) return;
      pen.setLineDash(last < 0 ? [3, 3] : []);
      pen.lineWidth = isNow || isChosen ? 2.5 : 1;
      const age = last < 0 ? 0 : this.getFreshness(last);
      pen.strokeStyle = isChosen ? colours.ink : isNow ? colours.look : mix(colours.line, colours.muted, last < 0 ? 0.4 : 0.3 + 0.7 * age);
      pen.stroke();
      pen.setLineDash([]);
    });
  }

  // Things of a place where they were seen, or in rows within it: dots on top, squares inside, rings where they are missing.
  drawThings() {
    const {viewport} = this;
    this.counts = [];
    this.plan.furniture.forEach((own, row) => {
      if (!this.isSeen[row]) return;
      const things = this.things[row].filter(thing => !thing.point);
      for (const thing of this.things[row]) {
        if (thing.point) this.drawThing(thing, row, viewport.toScreen(thing.point),
          Math.min(Math.max(THING_METRES * viewport.scale, SMALLEST_DOT), LARGEST_DOT));
      }
      if (!things.length) return;
      const [x, y, width, height, yaw] = own.inside;
      const columns = Math.min(Math.max(Math.ceil(Math.sqrt(things.length * width / height)), 1), things.length);
      const cell = Math.min(width / columns, height / Math.ceil(things.length / columns));
      const radius = Math.min(0.34 * cell * viewport.scale, LARGEST_DOT);
      if (radius < SMALLEST_DOT) {
        this.counts.push({row, count: things.filter(thing => thing.isThere).length});
        return;
      }
      const rows = Math.ceil(things.length / columns), [cos, sin] = [Math.cos(yaw), Math.sin(yaw)];
      things.forEach((thing, number) => {
        const right = ((number % columns) + 0.5) * width / columns - width / 2;
        const up = height / 2 - (Math.floor(number / columns) + 0.5) * height / rows;
        this.drawThing(thing, row, viewport.toScreen([x + cos * right - sin * up, y + sin * right + cos * up]), radius);
      });
    });
  }

  drawThing(thing, row, at, radius) {
    const {pen, colours, shown} = this, recent = Math.log1p(this.time.toSteps(3 * DAY, 72));
    this.dots.push({at, radius, thing, row});
    pen.beginPath();
    if (thing.isInside) pen.rect(at[0] - 0.85 * radius, at[1] - 0.85 * radius, 1.7 * radius, 1.7 * radius);
    else pen.arc(...at, radius, 0, 7);
    if (thing.isThere) {
      pen.fillStyle = mix(colours.fresh, colours.old, Math.min(Math.log1p(shown.state.step - thing.seen) / recent, 1));
      pen.fill();
    } else {
      pen.lineWidth = 1.1;
      pen.globalAlpha = thing.strength;
      pen.strokeStyle = colours.missing;
      pen.stroke();
      pen.globalAlpha = 1;
    }
  }

  // The way of the search, the truth, and a change that was chosen.
  drawMarks() {
    const {pen, colours, viewport, shown} = this, {answer, change} = shown;
    this.boxes = new Labels(viewport.width, viewport.height);
    this.stops = [];
    if (shown.showsSearch && answer?.search && !change) this.drawSearch(answer.search);
    for (const row of shown.showsTruth ? answer?.truth ?? [] : []) {
      const [, top, right] = this.bounds[row];
      pen.beginPath();
      for (let tip = 0; tip < 10; tip += 1) {
        const turn = Math.PI * tip / 5, size = tip % 2 ? 3.5 : 8;
        pen.lineTo(right - 4 + size * Math.sin(turn), top + 4 - size * Math.cos(turn));
      }
      pen.closePath();
      pen.fillStyle = colours.truth;
      pen.fill();
      pen.lineWidth = 1;
      pen.strokeStyle = colours.paper;
      pen.stroke();
    }
    if (change) this.drawChange(change);
  }

  // Numbers in the order of the looks, and the ways between them, through doors where they are known.
  drawSearch({looks, ways}) {
    const {pen, colours, viewport} = this, centres = [];
    looks.forEach(({furniture}, number) => {
      const [left, top, right] = this.bounds[furniture], [x, y] = viewport.toScreen(this.getMiddle(furniture));
      const box = this.boxes.place({width: 18, height: 18, number}, [[left - 7, top - 7], [right - 11, top - 7], [left - 18, top],
        [right, top], [x - 9, y - 9], [x - 9, top - 19]]);
      centres.push(box ? [box.left + 9, box.top + 9] : [x, y]);
      if (box) this.stops.push({box, furniture});
    });
    pen.lineWidth = 2;
    pen.strokeStyle = pen.fillStyle = colours.route;
    pen.setLineDash([2, 4]);
    pen.beginPath();
    centres.forEach((centre, number) => {
      for (const door of ways[number - 1] ?? []) pen.lineTo(...viewport.toScreen(door));
      pen.lineTo(...centre);
    });
    pen.stroke();
    pen.setLineDash([]);
    for (const {box} of this.stops) {
      pen.beginPath();
      pen.arc(box.left + 9, box.top + 9, 9, 0, 7);
      pen.fillStyle = colours.route;
      pen.fill();
      this.write(String(box.number + 1), box.left + 9, box.top + 13, "bold 11px", colours.paper, "center");
    }
  }

  drawChange(change) {
    const {pen, colours, viewport} = this;
    const [from, to] = [change.from_place, change.to_place].map(id => this.byId.get(id))
      .map(row => row === undefined ? null : viewport.toScreen(this.getMiddle(row)));
    pen.strokeStyle = pen.fillStyle = colours.change;
    pen.lineWidth = 2.5;
    if (from && to) {
      const [wide, tall] = [to[0] - from[0], to[1] - from[1]], size = Math.hypot(wide, tall) || 1;
      const middle = [(from[0] + to[0]) / 2 - 0.18 * tall, (from[1] + to[1]) / 2 + 0.18 * wide];
      pen.beginPath();
      pen.moveTo(...from);
      pen.quadraticCurveTo(...middle, ...to);
      pen.stroke();
      const turn = Math.atan2(to[1] - middle[1], to[0] - middle[0]);
      if (size > 12) {
        this.trace([0, 2.6, -2.6].map(beside => beside === 0 ? to
          : [to[0] - 13 * Math.cos(turn + beside / 7), to[1] - 13 * Math.sin(turn + beside / 7)]));
        pen.fill();
      }
    }
    for (const at of [from, to].filter(Boolean)) {
      pen.beginPath();
      pen.arc(...at, 12, 0, 7);
      pen.stroke();
    }
    if (from && !to) {
      pen.beginPath();
      for (const way of [1, -1]) {
        pen.moveTo(from[0] - 8, from[1] - 8 * way);
        pen.lineTo(from[0] + 8, from[1] + 8 * way);
      }
      pen.stroke();
    }
  }

  measure(text, font) {
    const key = font + text;
    if (!this.widths.has(key)) {
      this.pen.font = `${font} ${this.font}`;
      this.widths.set(key, this.pen.measureText(text).width);
    }
    return this.widths.get(key);
  }

  write(text, x, y, font, colour, align = "left") {
    const {pen} = this;
    pen.font = `${font} ${this.font}`;
    pen.textAlign = align;
    pen.lineJoin = "round";
    if (align === "left") {  // readable on whatever is below
      pen.lineWidth = 3;
      pen.strokeStyle = this.colours.paper;
      pen.strokeText(text, x, y);
    }
    pen.fillStyle = colour;
    pen.fillText(text, x, y);
  }

  // Names by importance; what finds no room is said where the mouse points, and written closer.
  drawLabels() {
    const {colours, shown} = this, wanted = [], isFloor = own => own.name === "floor" && own.toScale;
    const now = new Set(shown.state.looks.filter(look => look.step === shown.state.step).map(look => look.furniture));
    const pieces = new Boxes(), rooms = new Boxes();
    const add = (boxes, [left, top, right, bottom], own) => boxes.add({left, top, width: right - left, height: bottom - top, own});
    this.roomBounds.forEach((bounds, row) => this.isOnScreen(bounds) && add(rooms, bounds, row));
    this.plan.furniture.forEach((own, row) => {
      if (!this.isSeen[row] || isFloor(own)) return;
      add(pieces, this.bounds[row], row);
      const [left, top, right, bottom] = this.bounds[row], p = shown.answer?.probability?.[row] ?? 0;
      const isSaid = p >= SMALLEST, isChosen = own.id === shown.selected, isMain = isSaid || isChosen;
      const size = Math.min(right - left, bottom - top);
      if (!isMain && !now.has(row) && size < LEAST_PX) return;
      const font = isMain ? "bold 12px" : "11px", look = {height: 14, colour: isMain ? colours.ink : colours.muted};
      wanted.push({
        rank: (isSaid ? 2 + p : 0) + (isChosen ? 3 : 0) + (now.has(row) ? 1 : 0) + Math.min(size, 999) / 1e4,
        row, around: this.bounds[row],
        forms: isSaid ? [own.name, shortenName(own.name)].map(name => ({...look, font, text: `${sayShare(p)} ${name}`}))
          : [{...look, font, text: own.name}],
      });
    });
    const large = {font: "bold 13px", height: 16}, small = {font: "bold 10px", height: 12};
    const isTight = this.plan.rooms.some((room, row) => {  // all names of rooms have one size
      const [left, , right] = this.roomBounds[row];
      return this.measure(room.name, large.font) + 8 > right - left;
    });
    this.plan.rooms.forEach((room, row) => {
      if (!this.isOnScreen(this.roomBounds[row])) return;
      wanted.push({rank: 2.1, room: row, around: this.roomBounds[row],
        forms: [{...(isTight ? small : large), text: room.name, colour: mix(room.colour, colours.ink, 0.35)}]});
    });
    for (const {row, count} of this.counts) {
      wanted.push({rank: -1, row, isCount: true, around: this.bounds[row],
        forms: [{text: String(count), font: "10px", height: 12, colour: colours.muted}]});
    }
    wanted.sort((one, other) => other.rank - one.rank);
    this.labels = [];
    for (const {rank, forms, row, room, around, isCount} of wanted) {
      // No name stands on another piece of furniture or in another room: it would be taken for its name.
      const isBarred = box => pieces.isHit(box, other => other.own !== row, 1)
        || room !== undefined && rooms.isHit(box, other => other.own !== room, 3);
      const place = (form, bars, spare = 0) => {
        const label = {...form, row, room, width: this.measure(form.text, form.font) + 8};
        const near = [around[0] - spare, around[1] - spare, around[2] + spare, around[3] + spare];
        return this.boxes.place(label, listSpots(label, near, isCount), bars);
      };
      // Where furniture is smaller than a name, that of a likely place may cover its neighbours.
      const isLikely = rank >= 2 + LIKELY && around[2] - around[0] < SMALL_PX && around[3] - around[1] < SMALL_PX;
      const box = place(forms[0], isBarred) ?? (isLikely && room === undefined ? place(forms[0]) ?? place(forms[0], undefined, 12) : null)
        ?? (forms[1] ? place(forms[1], isBarred) : null);
      if (!box) continue;
      this.labels.push(box);
      this.write(box.text, box.left + 4, box.top + box.height - 3, box.font, box.colour);
    }
  }

  isOnScreen([left, top, right, bottom]) {
    return right > 0 && bottom > 0 && left < this.viewport.width && top < this.viewport.height;
  }

  // What is aimed at: a dot that is near, else the nearest furniture, a label or a stop being part of it.
  find([x, y], reach) {
    const dots = this.dots.map(dot => ({...dot, away: Math.hypot(dot.at[0] - x, dot.at[1] - y)}))
      .filter(dot => dot.away <= Math.max(dot.radius + 2, reach / 2));
    if (dots.length) return dots.reduce((one, other) => other.away < one.away ? other : one);
    const isOn = box => x >= box.left && y >= box.top && x <= box.left + box.width && y <= box.top + box.height;
    const stop = this.stops.find(one => isOn(one.box));
    if (stop) return {row: stop.furniture};
    const label = this.labels.find(box => box.row !== undefined && isOn(box));
    let best = null;
    this.shapes.forEach((points, row) => {
      if (!this.isSeen[row]) return;
      const away = getDistance(points, [x, y]);
      if (away > reach) return;
      const [left, top, right, bottom] = this.bounds[row];
      const found = {row, away, size: (right - left) * (bottom - top)};
      if (!best || away < best.away || away === best.away && found.size < best.size) best = found;
    });
    if (label && (!best || best.away > 0)) return {row: label.row};
    return best;
  }

  // What the mouse points at, in words.
  describe(found) {
    const {state, answer} = this.shown, own = this.plan.furniture[found.row];
    if (found.thing) {
      const ago = state.step - found.thing.seen;
      return `${found.thing.name}\n${own.name}, ${found.thing.adverb}\n`
        + (ago ? `seen ${this.time.sayLength(ago)} ago, ${this.time.say(found.thing.seen)}` : "seen in this step")
        + (found.thing.isThere ? "" : ", missing at the last look");
    }
    const p = answer?.probability?.[found.row], last = state.lastLook[found.row] ?? -1;
    return `${own.name}, ${this.plan.rooms[own.room].name}\n`
      + (p === undefined ? "" : `${(100 * p).toFixed(1)}%\n`)
      + (last < 0 ? "never looked at" : last === state.step ? "looked at in this step"
        : `looked at ${this.time.sayLength(state.step - last)} ago`)
      + `\n${this.things[found.row].filter(thing => thing.isThere).length} things`;
  }
}

// A share is never written without a name: a short one, where a longer one finds no room.
const shortenName = name => name.length > SHORT ? `${name.slice(0, SHORT - 1).trimEnd()}…` : name;

// Where a label may stand, the best spot first.
const listSpots = ({width, height, room}, [left, top, right, bottom], isCount) => {
  const middle = (left + right - width) / 2, centre = (top + bottom - height) / 2;
  if (room !== undefined) {
    const inside = [[left + 3, top + 2], [right - width - 3, top + 2], [left + 3, bottom - height - 2], [middle, centre], [left + 3, centre]];
    return [[left + 2, top - height - 1], ...width <= right - left ? inside : []];
  }
  const isRoomy = width <= right - left - 2 && height <= bottom - top - 2, within = [[middle, centre]];
  if (isCount) return isRoomy ? within : [];
  return [[middle, bottom + 1], [middle, top - height - 1], [right + 2, centre], [left - width - 2, centre],
    [left, bottom + 1], [right - width, bottom + 1], [left, top - height - 1], [right - width, top - height - 1],
    ...isRoomy ? [[middle, bottom - height - 2], [middle, top + 2], ...within] : []];
};
