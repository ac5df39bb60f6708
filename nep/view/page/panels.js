// What stands beside the map: answers, tables, and the list of what has changed.

// Adds an element with a text, which is never read as HTML.
const addText = (parent, tag, text, className) => {
  const node = document.createElement(tag);
  if (text !== undefined) node.textContent = text;
  if (className) node.className = className;
  parent.appendChild(node);
  return node;
};

const sayExactly = p => `${(100 * p).toFixed(p < 0.1 ? 1 : 0)}%`;

// Makes an element answer to clicks and to the keyboard.
const makeButton = (node, act) => {
  node.tabIndex = 0;
  node.setAttribute("role", "button");
  node.addEventListener("click", act);
  node.addEventListener("keydown", event => {
    if (event.key !== "Enter") return;
    event.preventDefault();
    act();
  });
};

// The answer: *elsewhere* on top with its bar, then the places, and the plan of a search.
const fillAnswer = (parent, answer, showsSearch, choose) => {
  parent.replaceChildren();
  if (!answer) return;
  if (answer.problem) {
    addText(parent, "p", answer.problem, "problem");
    return;
  }
  addText(parent, "h3", `${answer.title}, says ${answer.judge}`);
  const list = addText(parent, "ol", undefined, "answer");
  for (const row of answer.rows) {
    const item = addText(list, "li", undefined, row.name === "elsewhere" && row.furniture === undefined ? "is-elsewhere" : "");
    addText(item, "b", sayExactly(row.p));
    const bar = addText(addText(item, "span", undefined, "track"), "i");
    bar.style.width = `${100 * row.p}%`;
    addText(item, "span", row.relation ? `${row.name}, ${row.relation}` : row.name);
    if (row.why) addText(item, "small", row.why);
    if (row.picture) addText(item, "small", `picture: ${row.picture}`, "picture");
    if (row.furniture !== undefined) makeButton(item, () => choose(row.furniture));
  }
  if (!showsSearch || !answer.search.looks.length) return;
  addText(parent, "h3", "Search plan");
  const plan = addText(parent, "ol", undefined, "search");
  for (const look of answer.search.looks) {
    const item = addText(plan, "li", `${look.say}, cost ${look.cost}`);
    addText(item, "small", `a look shows it with ${sayExactly(look.shows)}, if it is there`);
  }
  addText(parent, "p", `shown by these looks with ${sayExactly(answer.search.found)}, expected cost ${answer.search.cost}`);
};

const fillTables = (parent, tables) => {
  parent.replaceChildren();
  for (const table of tables) {
    addText(parent, "h3", table.title);
    const node = addText(addText(parent, "div", undefined, "scroll"), "table");
    const head = addText(addText(node, "thead"), "tr");
    for (const name of table.head) addText(head, "th", name);
    const body = addText(node, "tbody");
    for (const row of table.rows) {
      const line = addText(body, "tr");
      for (const cell of row) addText(line, "td", cell);
    }
    if (table.note) addText(parent, "p", table.note);
  }
};

const KINDS = {new: "new", moved: "moved", gone: "gone", picked_up: "picked up"};

const sayPlaces = change => {
  const from = change.from ?? "a place that was removed", to = change.to ?? "a place that was removed";
  if (change.kind === "moved") return `${from} → ${to}`;
  if (change.kind === "new" && change.to_place === null) return "";  // where it was first is not kept
  if (change.kind === "new") return `on or in ${to}`;
  return `from ${from}`;
};

// What has changed, the latest first; a click goes to when and where it was noticed.
const fillChanges = (parent, changes, time, since, current, go) => {
  parent.replaceChildren();
  const rows = changes.rows.filter(change => change.time >= since);
  for (const change of rows) {
    const item = addText(parent, "li", undefined, `${change.kind} ${change.probability < 0.5 ? "is-unsure" : ""}`), button = addText(item, "button");
    button.type = "button";
    addText(button, "span", KINDS[change.kind], "kind");
    addText(button, "span", change.thing);
    addText(button, "span", sayExactly(change.probability));
    addText(button, "small", sayPlaces(change));
    const between = change.after === null ? `${change.kind === "new" ? "first " : ""}seen ${time.say(change.time)}`
      : `between ${time.say(change.after)} and ${time.say(change.time)}`;
    addText(button, "small", between + (change.by ? `, said by ${change.by}` : ""));
    if (change.picture) addText(button, "small", `picture: ${change.picture}`, "picture");
    button.setAttribute("aria-current", String(isSameChange(change, current)));
    button.addEventListener("click", () => go(change));
  }
  if (changes.more) addText(parent, "li", `and ${changes.more} earlier ones`);
  if (!rows.length) addText(parent, "li", "nothing in this time");
};

const isSameChange = (one, other) => other !== null && one.kind === other.kind && one.thing === other.thing
  && one.time === other.time && one.from_place === other.from_place;

const fillLegend = (parent, colours) => {
  parent.replaceChildren();
  for (const [text, colour, shape] of [
    ["thing on top, lately seen", colours.fresh, ""], ["long ago", colours.old, ""], ["inside", colours.fresh, "square"],
    ["missing at the last look", colours.missing, "ring"], ["looked from here, old looks fainter", colours.look, ""], ["likely place", colours.belief, "square"],
    ["search", colours.route, ""],
  ]) {
    const item = addText(parent, "li");
    addText(item, "i", undefined, shape).style.background = colour;
    item.append(text);
  }
};
