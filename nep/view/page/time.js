// Times of steps in words, and the ticks of a time axis: hours and dates where there is a clock, else steps.

const MINUTE = 60e3, HOUR = 60 * MINUTE, DAY = 24 * HOUR;
const INTERVALS = [5, 10, 30].map(n => n * MINUTE)
  .concat([1, 2, 3, 6, 12].map(n => n * HOUR), [1, 2, 7, 14, 28, 91, 182, 364].map(n => n * DAY));
const WEEKDAYS = ["Sun", "Mon", "Tue", "Wed", "Thu", "Fri", "Sat"];
const MONTHS = ["Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"];

const sayDate = date => `${WEEKDAYS[date.getUTCDay()]} ${date.getUTCDate()} ${MONTHS[date.getUTCMonth()]}`;
const sayHour = date => date.toISOString().slice(11, 16);

class Time {
  // The clock runs in local time without a zone: it is read and written as if it were UTC.
  constructor(clock) {
    this.start = clock ? Date.parse(clock.start + "Z") : null;
    this.stepMs = clock ? clock.stepSeconds * 1000 : null;
  }

  say(step) {
    if (this.start === null) return `step ${step}`;
    const date = new Date(this.start + step * this.stepMs);
    return `${sayDate(date)} ${sayHour(date)}`;
  }

  sayLength(steps) {
    if (this.start === null) return steps === 1 ? "1 step" : `${steps} steps`;
    const ms = steps * this.stepMs;
    if (ms < HOUR) return `${Math.round(ms / MINUTE)} min`;
    if (ms < 2 * DAY) return `${+(ms / HOUR).toFixed(1)} h`;
    return `${+(ms / DAY).toFixed(1)} days`;
  }

  toSteps(ms, otherwise) {
    return this.start === null ? otherwise : ms / this.stepMs;
  }

  // At most so many ticks between two steps: {step, label, isMajor}.
  listTicks(first, last, most) {
    const ticks = [];
    if (this.start === null) {
      let interval = 1;
      for (let turn = 0; (last - first) / interval > most; turn += 1) interval *= [2, 2.5, 2][turn % 3];
      for (let step = Math.ceil(first / interval) * interval; step <= last; step += interval) {
        ticks.push({step, label: String(step), isMajor: false});
      }
      return ticks;
    }
    const begin = this.start + first * this.stepMs, end = this.start + last * this.stepMs;
    const interval = INTERVALS.find(one => (end - begin) / one <= most) ?? INTERVALS.at(-1);
    // Whole hours from midnight on, whole days from the first midnight on.
    const origin = interval <= DAY ? 0 : Math.ceil(begin / DAY) * DAY % interval;
    for (let at = Math.ceil((begin - origin) / interval) * interval + origin; at <= end; at += interval) {
      const date = new Date(at), isMajor = at % DAY === 0;
      ticks.push({
        step: (at - this.start) / this.stepMs, isMajor,
        label: isMajor || ticks.length === 0 && interval >= DAY ? sayDate(date) : sayHour(date),
      });
    }
    if (ticks.length && !ticks.some(tick => tick.isMajor)) {  // a range within a day says which
      ticks[0].label = `${sayDate(new Date(this.start + ticks[0].step * this.stepMs))} ${ticks[0].label}`;
    }
    return ticks;
  }
}

const SVG = "http://www.w3.org/2000/svg";

// Adds an element to an SVG picture.
const addShape = (parent, tag, attributes, text) => {
  const node = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  if (text !== undefined) node.textContent = text;
  parent.appendChild(node);
  return node;
};

// Draws an axis below `y`; labels that would touch another are left out, hours before dates.
const drawAxis = (svg, time, first, last, toX, left, right, y) => {
  const ticks = time.listTicks(first, last, Math.max((right - left) / 48, 2)), taken = [];
  for (const tick of [...ticks.filter(one => one.isMajor), ...ticks.filter(one => !one.isMajor)]) {
    const x = toX(tick.step), half = 3.3 * tick.label.length;
    addShape(svg, "line", {class: "tick", x1: x, x2: x, y1: y, y2: y + (tick.isMajor ? 7 : 4)});
    const middle = Math.min(Math.max(x, left + half), right - half);
    if (taken.some(([other, size]) => Math.abs(middle - other) < half + size + 6)) continue;
    taken.push([middle, half]);
    addShape(svg, "text", {
      class: tick.isMajor ? "major" : "minor", x: middle, y: y + 17, "text-anchor": "middle",
    }, tick.label);
  }
};
