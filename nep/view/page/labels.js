// Puts labels where they touch no other: the important ones first; one that finds no room is left out.

const CELL = 48;  // pixels of the grid in which neighbours are looked up

// Boxes, {left, top, width, height}, by where they are.
class Boxes {
  constructor() {
    this.cells = new Map();
  }

  listKeys({left, top, width, height}) {
    const keys = [];
    for (let x = Math.floor(left / CELL); x <= Math.floor((left + width) / CELL); x += 1) {
      for (let y = Math.floor(top / CELL); y <= Math.floor((top + height) / CELL); y += 1) keys.push(x * 4096 + y);
    }
    return keys;
  }

  add(box) {
    for (const key of this.listKeys(box)) {
      if (!this.cells.has(key)) this.cells.set(key, []);
      this.cells.get(key).push(box);
    }
  }

  // Whether a box overlaps one of these that passes a test, by more than some pixels.
  isHit(box, passes, spare = 0) {
    return this.listKeys(box).some(key => (this.cells.get(key) ?? []).some(other => passes(other)
      && box.left + spare < other.left + other.width && other.left + spare < box.left + box.width
      && box.top + spare < other.top + other.height && other.top + spare < box.top + box.height));
  }
}

class Labels {
  constructor(width, height) {
    [this.width, this.height] = [width, height];
    this.taken = new Boxes();
  }

  // Takes the first free one of some spots, [left, top], for a label; null if there is none.
  place(label, spots, isBarred = () => false) {
    for (const [left, top] of spots) {
      const box = {...label, left, top};
      const isOff = left < 0 || top < 0 || left + box.width > this.width || top + box.height > this.height;
      if (isOff || this.taken.isHit(box, () => true) || isBarred(box)) continue;
      this.taken.add(box);
      return box;
    }
    return null;
  }
}
