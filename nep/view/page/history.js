// The history of one thing: belief as shades, the truth as bars, looks as marks, place by place.

const ROW_PX = 26;
const AGES = 6;  // shades of the marks: old looks are lighter

// Draws into an element; `pick` gets the step that is clicked.
const drawHistory = (parent, trace, time, now, pick) => {
  parent.replaceChildren();
  addText(parent, "h3", trace.words);
  const width = Math.max(parent.clientWidth, 280), left = Math.min(190, 0.36 * width), right = width - 8;
  const [first, last] = [trace.edges[0], trace.edges.at(-1)], bottom = 6 + ROW_PX * trace.places.length;
  const toX = step => left + (right - left) * (step - first) / Math.max(last - first, 1e-9);
  const svg = addShape(parent, "svg", {height: bottom + 22, role: "img", "aria-label": `history of ${trace.words}`});
  trace.places.forEach((place, row) => {
    const y = 6 + ROW_PX * row, most = Math.floor(left / 6.3);
    const label = addShape(svg, "text", {class: "row", x: 0, y: y + 16}, place.length > most ? `${place.slice(0, most - 1)}…` : place);
    addShape(label, "title", {}, place);
    addShape(svg, "rect", {x: left, y: y + 1, width: right - left, height: ROW_PX - 4, fill: "var(--ground)"});
    trace.belief?.[row].forEach((p, cell) => {
      if (!p) return;
      const x = toX(trace.edges[cell]);
      const mark = addShape(svg, "rect", {x, y: y + 1, width: toX(trace.edges[cell + 1]) - x, height: ROW_PX - 4,
        fill: "var(--belief)", "fill-opacity": Math.sqrt(p).toFixed(3), "shape-rendering": "crispEdges"});
      addShape(mark, "title", {}, `${sayShare(p)}, ${place}, ${time.say(Math.round(trace.edges[cell]))}`);
    });
  });
  for (const [row, begin, end] of trace.stays) {
    addShape(svg, "line", {x1: toX(begin), x2: toX(end), y1: 19 + ROW_PX * row, y2: 19 + ROW_PX * row,
      stroke: "var(--truth)", "stroke-width": 4});
  }
  // One path for all marks of an age: thousands of looks stay fluid.
  const paths = new Map();
  for (const [step, row, isFound] of trace.looks) {
    const age = Math.min(Math.floor(AGES * Math.max(now - step, 0) / Math.max(now - first, 1)), AGES - 1);
    const key = `${isFound} ${age}`, x = toX(step).toFixed(1), y = 6 + ROW_PX * row;
    const mark = isFound ? `M${x} ${y + 4.6}a3 3 0 1 0 .01 0z` : `M${x} ${y + 4}v7`;
    paths.set(key, (paths.get(key) ?? "") + mark);
  }
  for (const [key, path] of [...paths].sort()) {
    const [isFound, age] = key.split(" ").map(Number), shade = 1 - 0.78 * age / (AGES - 1);
    addShape(svg, "path", isFound ? {d: path, fill: "var(--fresh)", "fill-opacity": shade}
      : {d: path, stroke: "var(--missing)", "stroke-opacity": 0.7 * shade, "stroke-width": 1.2, fill: "none"});
  }
  for (const [step, row, by] of trace.said) {
    const mark = addShape(svg, "path", {d: `M${toX(step)} ${6 + ROW_PX * row + 2}l5 5-5 5-5-5z`, fill: "var(--change)"});
    addShape(mark, "title", {}, `said by ${by}, ${time.say(step)}`);
  }
  drawAxis(svg, time, first, last, toX, left, right, bottom);
  if (now >= first && now <= last) addShape(svg, "line", {class: "now", x1: toX(now), x2: toX(now), y1: 0, y2: bottom});
  svg.addEventListener("click", event => {
    const x = event.clientX - svg.getBoundingClientRect().left;
    if (x >= left) pick(Math.round(first + (x - left) / (right - left) * (last - first)));
  });
  addText(parent, "p", `Orange: believed to be there; ${trace.stays.length ? "pink bar: truly there; " : ""}`
    + "blue dot: a look saw it; red stroke: a look did not; "
    + `${trace.said.length ? "diamond: said to be there; " : ""}old looks are fainter.`, "note");
};
