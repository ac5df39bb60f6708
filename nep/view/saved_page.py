"""The page as one file: no server, no display, nothing from the network."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from html import escape
from pathlib import Path
from typing import Any

from nep.view.answers import Desk
from nep.view.style import CSS
from nep.view.texts import tell_furniture, tell_step
from sgm.files import write_whole

MOST_FRAMES = 60  # steps of a story
_MOST_FURNITURE = 200  # whose tables are kept

# The same parts as on the live page, filled from data; texts are never read as HTML.
_SCRIPT = """
const page = JSON.parse(document.getElementById("data").textContent);
const find = id => document.getElementById(id);
let frame = page.frames.length - 1, timer = null, selected = null;
const make = (tag, text, parent) => {
  const node = document.createElement(tag);
  if (text !== undefined) node.textContent = text;
  if (parent) parent.appendChild(node);
  return node;
};
const addTable = (table, parent) => {
  make("h3", table.title, parent);
  const node = make("table", undefined, parent);
  const head = make("tr", undefined, make("thead", undefined, node));
  table.head.forEach(name => make("th", name, head));
  const body = make("tbody", undefined, node);
  table.rows.forEach(row => {
    const line = make("tr", undefined, body);
    row.forEach(cell => make("td", cell, line));
  });
  if (table.note) make("p", table.note, parent);
};
const config = {scrollZoom: true, displayModeBar: false, responsive: true};
const draw = () => {
  const asked = find("words").value || "", now = page.frames[frame], answer = now.answers[asked];
  Plotly.react("map-a", answer.figure.data, answer.figure.layout, config);
  find("answer-a").replaceChildren();
  answer.tables.forEach(table => addTable(table, find("answer-a")));
  if (answer.problem) make("p", answer.problem, find("answer-a"));
  find("time").textContent = now.time;
  find("events").replaceChildren();
  now.events.forEach(line => make("li", line, find("events")));
  const history = page.histories[asked];
  if (history) {
    history.layout.shapes.forEach(line => { line.x0 = line.x1 = now.hour; });
    Plotly.react("history", history.data, history.layout, {...config, scrollZoom: false});
  }
  const tables = page.furniture[selected];
  if (tables) {
    find("furniture").replaceChildren();
    tables.forEach(table => addTable(table, find("furniture")));
  }
};
const move = to => { frame = to; find("step").value = to; draw(); };
find("step").max = page.frames.length - 1;
find("step").value = frame;
find("step").addEventListener("input", event => move(Number(event.target.value)));
find("words").addEventListener("change", draw);
find("play").addEventListener("click", () => {
  if (timer) { clearInterval(timer); timer = null; find("play").textContent = "\\u25b6"; return; }
  find("play").textContent = "\\u275a\\u275a";
  if (frame === page.frames.length - 1) frame = -1;
  timer = setInterval(() => {
    move(frame + 1);
    if (frame === page.frames.length - 1) find("play").click();
  }, 500);
});
page.asked.forEach(words => { make("option", words, find("words")).value = words; });
draw();
find("map-a").on("plotly_click", event => {
  const owner = event.points[0].customdata;
  if (owner && owner[0] === "furniture") { selected = owner[1]; draw(); }
});
"""


def save_page(desk: Desk, asked: Sequence[str], path: Path) -> None:
    """Write the page to a file that any browser opens.

    It holds the answers of the first judge to what is asked, at up to `MOST_FRAMES` steps;
    furniture is described as of the last step.

    Args:
        desk: answers.
        asked: questions to choose from.
        path: such as "page.html".

    Raises:
        ModuleNotFoundError: if plotly is not installed.
        ValueError: if something that is asked is no name.
        OSError: if the file cannot be written.
    """
    try:
        from plotly.offline import get_plotlyjs
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            "the page must find the package plotly, got none. Install it with "
            "`pip install scene-graph-memory[view]`."
        ) from error
    story, judge = desk.stage.story, desk.judges.names[0]
    questions = list(asked) or [""]
    steps = story.choose_steps(MOST_FRAMES)
    frames = []
    for step in steps:
        answers = {words: asdict(desk.answer(step, words, judge)) for words in questions}
        events = tell_step(story, story.memory_at(step), step)
        time, hour = story.get_time(step), step * story.step_hours
        frames.append({"time": time, "hour": hour, "events": events, "answers": answers})
    last = story.memory_at(story.num_steps)
    content: dict[str, Any] = {
        "asked": questions,
        "frames": frames,
        "histories": {
            words: desk.trace(words, judge, story.num_steps) for words in questions if words
        },
        "furniture": {
            number: [asdict(table) for table in tell_furniture(story, last, number)]
            for number in last.furniture_ids[:_MOST_FURNITURE]
        },
    }
    # A "<" of a name could end the element that holds the data.
    data = json.dumps(content, separators=(",", ":")).replace("<", "\\u003c")
    page = f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{escape(story.title)}</title>
<style>{CSS}</style></head><body>
<div class="head"><h1>{escape(story.title)}</h1></div>
<div class="bar"><label for="words">where is</label><select id="words"></select>
<span>says {escape(judge)}</span><button id="play">&#9654;</button>
<input class="slider" type="range" min="0" step="1" id="step"><div id="time"></div></div>
<div class="main"><div class="maps"><div class="side"><div class="map" id="map-a"></div></div></div>
<div class="answers"><div id="answer-a"></div></div></div>
<div class="below"><div><h2>In this step</h2><ul id="events"></ul></div>
<div class="wide"><h2>History</h2><div id="history"></div></div>
<div><h2>Furniture</h2><div id="furniture">click one on the map</div></div></div>
<script>{get_plotlyjs()}</script>
<script type="application/json" id="data">{data}</script>
<script>{_SCRIPT}</script></body></html>
"""
    write_whole(path, page.encode())
