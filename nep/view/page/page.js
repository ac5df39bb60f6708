// The page: what a word, a click or a key leads to.

const find = id => document.getElementById(id);
const data = JSON.parse(find("data").textContent);
const source = new Source(data), time = new Time(data.clock), viewport = new Viewport();
const SPEEDS = [1, 2, 4, 10, 30];  // steps in a second
const SIDES = ["a", "b"].map(name => {
  const canvas = find(`map-${name}`);
  return {map: new HomeMap(canvas, viewport, time), canvas, side: canvas.parentNode, judge: find(`judge-${name}`), panel: find(`answer-${name}`)};
});
let step = data.last;  // that is shown
let words = data.asked, thing = null, selected = null, change = null, trace = null;
let changes = {rows: [], more: 0}, listedStep = null, playing = null, isBusy = false, wanted = null;

const getPosition = at => Math.max(source.steps.findLastIndex(one => one <= at), 0);
const report = problem => { find("problem").textContent = problem; };
const guard = act => (...values) => Promise.resolve(act(...values)).catch(error => report(error.message));

const redraw = () => SIDES.forEach(({side, map}) => side.hidden || map.draw());

const measureMaps = () => {
  const {canvas} = SIDES[0];
  viewport.resize(canvas.clientWidth, canvas.clientHeight);
  redraw();
};

// Shows a step; while one is being fetched, only the last one that is wanted is remembered.
const show = guard(async (at = step) => {
  wanted = source.steps[getPosition(at)];
  if (isBusy) return;
  isBusy = true;
  try {
    while (wanted !== null) {
      const next = wanted;
      wanted = null;
      const judges = SIDES.map(({judge}, number) => number && !judge.value ? null : judge.value);
      const [state, ...answers] = await Promise.all(
        [source.readState(next), ...judges.map(judge => source.readAnswer(next, words, judge))]);
      if (state === null) break;  // the story has no such step any more
      step = next;
      draw(state, answers, judges);
    }
  } finally {
    isBusy = false;
  }
});

const draw = (state, answers, judges) => {
  find("step").value = step;
  find("step").setAttribute("aria-valuetext", time.say(step));
  find("time").textContent = time.say(step);
  SIDES.forEach(({map, side, panel, canvas}, number) => {
    side.hidden = number === 1 && !judges[1];
    const answer = answers[number], showsSearch = find("shows-search").checked;
    fillAnswer(panel, answer, showsSearch, choosePlace);
    if (side.hidden) return;
    side.querySelector(".judge").textContent = judges[1] && words ? judges[number] : "";
    canvas.setAttribute("aria-label", `map of the home, ${time.say(step)}`);
    map.shown = null;
    Object.assign(map, {plan: state.plan});
    if (!viewport.box) {
      viewport.resize(canvas.clientWidth, canvas.clientHeight);
      viewport.fit(map.plan.furniture.length || map.plan.rooms.length ? map.getExtent() : [0, 0, 1, 1]);
    } else viewport.box = map.plan.furniture.length ? map.getExtent() : viewport.box;
    map.show({state, answer: answer?.problem ? null : answer, names: source.names, selected, change, showsSearch,
      showsTruth: find("shows-truth").checked});
  });
  find("events").replaceChildren();
  for (const line of state.events) addText(find("events"), "li", line);
  measureMaps();
  drawHistoryNow();
  later("panels", guard(async () => {
    await fillPlace();
    if (change === null) await listChanges();
  }), playing ? 800 : 120);
};

// Does something once, a moment after it was last asked for, but not later than that after the first time.
const timers = new Map();
const later = (name, act, ms) => {
  if (timers.has(name)) return;
  timers.set(name, setTimeout(() => {
    timers.delete(name);
    act();
  }, ms));
};

const NO_HISTORY = "Ask for a thing, or click one on the map.";

const drawHistoryNow = () => trace && drawHistory(find("history"), trace, time, step, at => go(at));

const readHistory = guard(async () => {
  const asked = thing ?? words, judge = SIDES[0].judge.value;
  if (trace?.words !== asked) {
    trace = null;
    find("history").replaceChildren();
    addText(find("history"), "p", asked ? `asking for the history of ${asked} …` : NO_HISTORY);
  }
  const found = await source.readTrace(asked, judge);
  if (asked !== (thing ?? words) || judge !== SIDES[0].judge.value) return;  // another one is asked for by now
  trace = found;
  if (trace) drawHistoryNow();
  else if (asked) addText(find("history"), "p", "none is kept").previousSibling?.remove();
});

const fillPlace = async () => {
  if (selected === null) {
    find("furniture").replaceChildren();
    addText(find("furniture"), "p", "Click furniture on the map, or a place of the answer.");
    return;
  }
  fillTables(find("furniture"), await source.readFurniture(step, selected));
};

const listChanges = async () => {
  listedStep = step;
  changes = await source.readChanges(step);
  showChanges();
};

const showChanges = () => {
  const steps = find("since").value === "" ? Infinity : time.toSteps(Number(find("since").value) * HOUR, Number(find("since").value));
  find("changed-until").textContent = `by ${time.say(listedStep)}; a click goes there`;
  fillChanges(find("changes"), changes, time, listedStep - steps, change, guard(goToChange));
};

// Moves in time; another list of changes belongs to another time, except that of a change that was chosen.
const go = at => {
  change = null;
  return show(at);
};

const goToChange = async chosen => {
  pause();
  change = chosen;
  thing = chosen.thing;
  selected = chosen.to_place ?? chosen.from_place;
  showChanges();
  await show(chosen.time);
  const {map} = SIDES[0];
  viewport.reveal([chosen.from_place, chosen.to_place].map(id => map.byId.get(id)).filter(row => row !== undefined).map(row => map.getMiddle(row)));
  redraw();
  await readHistory();
};

const choosePlace = furniture => {
  selected = furniture;
  const {map} = SIDES[0], row = map.byId.get(furniture);
  if (row !== undefined) viewport.reveal([map.getMiddle(row)]);
  return show();
};

const pause = () => {
  clearTimeout(playing);
  playing = null;
  find("play").textContent = "▶";
};

const play = () => {
  if (playing !== null) return pause();
  if (step >= source.steps.at(-1)) go(source.steps[0]);
  find("play").textContent = "❚❚";
  const tick = async () => {
    if (!isBusy) {
      const position = getPosition(step);
      if (position >= source.steps.length - 1) return pause();
      await go(source.steps[position + 1]);
    }
    if (playing !== null) playing = setTimeout(tick, 1000 / SPEEDS[find("speed").value]);
  };
  playing = setTimeout(tick, 1000 / SPEEDS[find("speed").value]);
};

const drawSlider = () => {
  const {steps} = source, svg = find("axis"), width = find("step").clientWidth, thumb = 8;
  Object.assign(find("step"), {min: steps[0], max: steps.at(-1), disabled: steps.length < 2});
  svg.replaceChildren();
  svg.setAttribute("height", 20);
  const toX = at => thumb + (width - 2 * thumb) * (at - steps[0]) / Math.max(steps.at(-1) - steps[0], 1);
  if (steps.length > 1) drawAxis(svg, time, steps[0], steps.at(-1), toX, 0, width, 0);
};

const ask = guard(async asked => {
  [words, thing, change] = [asked.trim(), null, null];
  await show();
  await readHistory();
});

const addOptions = (select, rows) => {
  for (const [value, text] of rows) addText(select, "option", text).value = value;
};

const setUp = () => {
  addText(document.querySelector("h1"), "span", data.title);
  find("problem").textContent = data.problem;
  find("words").hidden = Boolean(source.saved);
  find("words").value = words;
  find("asked").hidden = !source.saved;
  document.querySelector("#ask button").hidden = Boolean(source.saved);
  if (source.saved) {
    addOptions(find("asked"), source.saved.asked.map(one => [one, one]));
    find("asked").hidden = !source.saved.asked.length;
  }
  addOptions(SIDES[0].judge, data.judges.map(name => [name, name]));
  addOptions(SIDES[1].judge, [["", "no second answer"], ...data.judges.map(name => [name, name])]);
  SIDES[1].judge.parentNode.hidden = data.judges.length < 2;
  find("truth-box").hidden = !data.hasTruth;
  addOptions(find("speed"), SPEEDS.map((speed, row) => [row, data.clock ? `${time.sayLength(speed)} a second` : `${speed} steps a second`]));
  find("speed").value = 1;
  addOptions(find("since"), data.clock ? [["", "since the start"], [168, "in a week"], [24, "in a day"], [6, "in 6 hours"]]
    : [["", "since the start"], [100, "in 100 steps"], [10, "in 10 steps"], [1, "in the last step"]]);
  find("keys").textContent = "Keys: space plays, ← → a step (with shift ten), Home and End, / asks, Esc lets go; "
    + "on the map: arrows move it, + and − zoom, 0 shows all.";

  find("ask").addEventListener("submit", event => {
    event.preventDefault();
    ask(find("words").value);
  });
  find("asked").addEventListener("change", () => ask(find("asked").value));
  for (const {judge} of SIDES) {
    judge.addEventListener("change", () => {
      show();
      readHistory();
    });
  }
  for (const id of ["shows-search", "shows-truth"]) find(id).addEventListener("change", () => show());
  find("since").addEventListener("change", showChanges);
  find("step").addEventListener("input", event => go(Number(event.target.value)));
  find("play").addEventListener("click", play);
  find("theme").addEventListener("click", () => {
    const root = document.documentElement, isDark = getComputedStyle(root).getPropertyValue("--paper").trim() !== "#ffffff";
    root.dataset.theme = isDark ? "light" : "dark";
    fillLegend(find("legend"), readColours());
    redraw();
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    fillLegend(find("legend"), readColours());
    redraw();
  });
  const zoom = (id, act) => find(id).addEventListener("click", () => {
    act();
    redraw();
  });
  zoom("closer", () => viewport.zoom(1.5));
  zoom("farther", () => viewport.zoom(1 / 1.5));
  zoom("fit", () => viewport.fit());
  fillLegend(find("legend"), readColours());
  SIDES.forEach(listenToSide);
  document.addEventListener("keydown", pressKey);
  new ResizeObserver(() => {
    measureMaps();
    drawSlider();
    drawHistoryNow();
  }).observe(document.querySelector("main"));
};

const listenToSide = ({map, canvas}) => {
  const tap = (at, reach) => {
    const found = map.find(at, reach);
    if (!found) return;
    selected = map.plan.furniture[found.row].id;
    if (found.thing) {
      thing = found.thing.name;
      readHistory();
    }
    show();
  };
  const hover = (at, reach) => {
    const found = at && map.shown && map.find(at, reach), tip = find("tip");
    tip.hidden = !found;
    canvas.style.cursor = found ? "pointer" : "";
    if (!found) return;
    tip.textContent = map.describe(found);
    const place = canvas.getBoundingClientRect(), whole = tip.parentNode.getBoundingClientRect();
    const left = at[0] + place.left - whole.left + 14;
    tip.style.left = `${Math.max(Math.min(left, whole.width - tip.offsetWidth - 4), 0)}px`;
    tip.style.top = `${at[1] + place.top - whole.top + 16}px`;
  };
  listenToMap(canvas, viewport, redraw, tap, hover);
};

const MOVES = {ArrowLeft: [60, 0], ArrowRight: [-60, 0], ArrowUp: [0, 60], ArrowDown: [0, -60]};

const pressKey = event => {
  const target = event.target, isTyped = target.matches("input[type=text], select");
  if (event.key === "Escape") {
    [selected, change, thing] = [null, null, null];
    target.blur?.();
    show();
    return readHistory();
  }
  if (isTyped || event.ctrlKey || event.metaKey || event.altKey) return undefined;
  const isMap = target.tagName === "CANVAS", position = getPosition(step), jump = event.shiftKey ? 10 : 1;
  const to = row => go(source.steps[Math.min(Math.max(row, 0), source.steps.length - 1)]);
  const acts = {
    "+": () => viewport.zoom(1.5), "=": () => viewport.zoom(1.5), "-": () => viewport.zoom(1 / 1.5), "0": () => viewport.fit(),
    "/": () => find(source.saved ? "asked" : "words").focus(), Home: () => to(0), End: () => to(source.steps.length - 1),
    ArrowLeft: () => to(position - jump), ArrowRight: () => to(position + jump),
  };
  if (!target.matches("button, [role=button]")) acts[" "] = play;
  if (isMap && MOVES[event.key]) acts[event.key] = () => viewport.move(...MOVES[event.key]);
  if (!acts[event.key]) return undefined;
  event.preventDefault();
  acts[event.key]();
  return redraw();
};

// Follows a story that goes on: the last step stays the last one, an earlier one stays as it is.
const watch = guard(async () => {
  const now = await source.ask("watch"), isLast = step >= source.steps.at(-1);
  report(now.problem);
  if (now.version === source.version) return;
  source.setRange(now);
  drawSlider();
  await show(isLast || step < now.first ? now.last : step);
  await readHistory();
});

setUp();
drawSlider();
await show();
await readHistory();
if (data.isLive && !source.saved) {
  for (;;) {
    await new Promise(done => { setTimeout(done, 1000); });
    await watch();
  }
}
