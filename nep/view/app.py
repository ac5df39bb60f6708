"""The page: what stands where, and what a click or a word leads to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import flask
from dash import Dash, Input, Output, State, ctx, dcc, html, no_update
from dash.exceptions import DependencyException, PreventUpdate

from nep.view.answers import Desk
from nep.view.inputs import MOST_BYTES, NOBODY, Inputs, list_options
from nep.view.map_figure import View
from nep.view.style import PAGE
from nep.view.texts import TextTable, tell_furniture, tell_step
from simulator.replay.story import Story

_HOSTS = ("127.0.0.1", "localhost")
_FRAME_MS = 600  # while it plays
_WATCH_MS = 1000  # between two looks at a story that goes on
_MAP_CONFIG: Any = {"scrollZoom": True, "displaylogo": False, "displayModeBar": False}


def make_app(desk: Desk, asked: str = "") -> Dash:
    """Make the page.

    Args:
        desk: answers.
        asked: what is asked at first.
    """
    app = Dash(
        "nep.view", title="Scene graph memory", update_title="", serve_locally=True,
        assets_folder="", index_string=PAGE, include_assets_files=False,
    )  # fmt: skip
    app.layout = _lay_out(desk, asked)
    _answer_questions(app, desk)
    _move_in_time(app, desk)
    _answer_clicks(app, desk)
    _refuse_forgeries(app, Inputs(desk, app.callback_map))
    return app


def _refuse_forgeries(app: Dash, inputs: Inputs) -> None:
    """Answer this machine alone, and only what the page itself can send."""
    app.server.config["MAX_CONTENT_LENGTH"] = MOST_BYTES

    @app.server.before_request
    def check() -> tuple[str, int, dict[str, str]] | None:
        if flask.request.host.rpartition(":")[0] not in _HOSTS:
            flask.abort(403)
        if flask.request.method != "POST":
            return None
        try:
            inputs.check(flask.request.get_data())
        except ValueError as error:
            return f"{error}\n", 400, {"Content-Type": "text/plain; charset=utf-8"}
        return None

    @app.server.errorhandler(DependencyException)
    def miss(error: Exception) -> tuple[str, int]:
        return "no such file\n", 404


def _lay_out(desk: Desk, asked: str) -> html.Div:
    story, names = desk.stage.story, desk.judges.names
    options = list_options(story)
    bar = html.Div(
        [
            dcc.Input(
                id="words", value=asked, placeholder="ask for anything: the red mug",
                type="text", debounce=False, autoComplete="off",
            ),
            html.Button("Ask", id="ask"),
            html.Label("says", htmlFor="judge-a"),
            dcc.Dropdown(names, names[0], id="judge-a", clearable=False),
            html.Label("beside", htmlFor="judge-b"),
            dcc.Dropdown([NOBODY, *names], NOBODY, id="judge-b", clearable=False),
            dcc.Checklist(options, options, id="options", inline=True),
        ],
        className="bar",
    )  # fmt: skip
    last = max(story.num_steps, story.first_step + 1)  # a slider needs a width
    time = html.Div(
        [
            html.Button("▶", id="play", title="play and pause"),
            html.Div(
                dcc.Slider(
                    story.first_step, last, 1, value=story.num_steps, marks=None, id="step",
                    updatemode="drag", disabled=story.num_steps == story.first_step,
                    allow_direct_input=False,
                ),
                className="slider",
            ),
            html.Div(id="time"),
        ],
        className="bar",
    )  # fmt: skip
    maps = html.Div(
        [
            html.Div(
                dcc.Graph(id=f"map-{side}", config=_MAP_CONFIG, className="map"),
                id=f"side-{side}", className="side",
            )
            for side in "ab"
        ],
        className="maps",
    )  # fmt: skip
    answers = html.Div([html.Div(id=f"answer-{side}") for side in "ab"], className="answers")
    return html.Div(
        [
            html.Div([html.H1(story.title), html.Div(id="problem")], className="head"),
            bar,
            time,
            html.Div([maps, answers], className="main"),
            html.Div(
                [
                    html.Div([html.H2("In this step"), html.Ul(id="events")]),
                    html.Div(
                        [
                            html.H2("History"),
                            dcc.Graph(id="history", config={"displayModeBar": False}),
                        ],
                        className="wide",
                    ),
                    html.Div(
                        [html.H2("Furniture"), html.Div("click one on the map", id="furniture")]
                    ),
                ],
                className="below",
            ),
            dcc.Store(id="asked", data=asked),
            dcc.Store(id="view-a"),
            dcc.Store(id="view-b"),
            dcc.Store(id="selected"),
            dcc.Store(id="object"),
            dcc.Store(id="version", data=0),
            dcc.Interval(id="tick", interval=_FRAME_MS, disabled=True),
            dcc.Interval(id="watch", interval=_WATCH_MS, disabled=not desk.stage.is_live),
        ]
    )


def _answer_questions(app: Dash, desk: Desk) -> None:
    @app.callback(
        Output("asked", "data"),
        Output("object", "data", allow_duplicate=True),
        Input("ask", "n_clicks"),
        Input("words", "n_submit"),
        State("words", "value"),
        prevent_initial_call=True,
    )
    def ask(clicks: int, submits: int, words: str | None) -> tuple[str, None]:
        return (words or "").strip(), None

    for side in "ab":

        @app.callback(
            Output(f"view-{side}", "data"),
            Input(f"map-{side}", "relayoutData"),
            prevent_initial_call=True,
        )
        def zoom(change: dict[str, Any] | None) -> Any:
            view = _read_view(change)
            is_reset = any("autorange" in key for key in change or ())
            return view if view is not None or is_reset else no_update

        @app.callback(
            Output(f"map-{side}", "figure"),
            Output(f"side-{side}", "hidden"),
            Output(f"answer-{side}", "children"),
            Input("asked", "data"),
            Input("step", "value"),
            Input(f"judge-{side}", "value"),
            Input("options", "value"),
            Input(f"view-{side}", "data"),
            Input("selected", "data"),
            Input("version", "data"),
        )
        def answer(
            asked: str,
            step: int,
            judge: str,
            options: Sequence[str],
            view: Sequence[float] | None,
            selected: int | None,
            version: int,
        ) -> tuple[Any, bool, Any]:
            if judge == NOBODY:
                return no_update, True, None
            story = _get_story(desk, step)
            found = desk.answer(step, asked, judge, options, view, selected, story)
            tables: list[Any] = [_make_table(table) for table in found.tables]
            if found.problem:
                tables.append(html.P(found.problem, className="problem"))
            return found.figure, False, tables


def _move_in_time(app: Dash, desk: Desk) -> None:
    @app.callback(
        Output("tick", "disabled"),
        Output("play", "children"),
        Output("step", "value", allow_duplicate=True),
        Input("play", "n_clicks"),
        Input("tick", "n_intervals"),
        State("tick", "disabled"),
        State("step", "value"),
        prevent_initial_call=True,
    )
    def play(clicks: int, ticks: int, is_paused: bool, step: int) -> tuple[bool, str, Any]:
        story = desk.stage.story
        is_at_end = step >= story.num_steps
        if ctx.triggered_id == "play":
            if not is_paused:
                return True, "▶", no_update
            return False, "❚❚", story.first_step if is_at_end else no_update
        return (True, "▶", no_update) if is_at_end else (False, "❚❚", step + 1)

    @app.callback(
        Output("time", "children"),
        Output("events", "children"),
        Input("step", "value"),
        Input("version", "data"),
    )
    def tell(step: int, version: int) -> tuple[str, list[html.Li]]:
        story = _get_story(desk, step)
        lines = tell_step(story, story.memory_at(step), step)
        return story.get_time(step), [html.Li(line) for line in lines]

    @app.callback(
        Output("version", "data"),
        Output("step", "max"),
        Output("step", "value", allow_duplicate=True),
        Output("problem", "children"),
        Input("watch", "n_intervals"),
        State("version", "data"),
        State("step", "value"),
        State("step", "max"),
        prevent_initial_call=True,
    )
    def watch(ticks: int, version: int, step: int, last: int) -> tuple[Any, Any, Any, str]:
        desk.stage.refresh()
        story, now = desk.stage.story, desk.stage.version
        if now == version:
            return no_update, no_update, no_update, desk.stage.problem
        follows = step >= last or step < story.first_step
        shown = story.num_steps if follows else min(step, story.num_steps)
        return now, max(story.num_steps, story.first_step + 1), shown, desk.stage.problem


def _answer_clicks(app: Dash, desk: Desk) -> None:
    @app.callback(
        Output("selected", "data"),
        Output("object", "data"),
        Input("map-a", "clickData"),
        Input("map-b", "clickData"),
        prevent_initial_call=True,
    )
    def click(first: Any, second: Any) -> tuple[Any, Any]:
        clicked = first if ctx.triggered_id == "map-a" else second
        owner = clicked["points"][0].get("customdata") if clicked else None
        kind, value = owner or (None, None)
        if kind == "furniture":
            return value, no_update
        return no_update, value if kind == "object" else no_update

    @app.callback(
        Output("furniture", "children"),
        Input("selected", "data"),
        Input("step", "value"),
        Input("version", "data"),
        prevent_initial_call=True,
    )
    def tell(selected: int | None, step: int, version: int) -> Any:
        story = _get_story(desk, step)
        memory = story.memory_at(step)
        if selected not in memory.furniture_ids:
            return "click one on the map"
        return [_make_table(table) for table in tell_furniture(story, memory, selected)]

    @app.callback(
        Output("history", "figure"),
        Input("object", "data"),
        Input("asked", "data"),
        Input("judge-a", "value"),
        Input("step", "value"),
        Input("version", "data"),
    )
    def trace(clicked: str | None, asked: str, judge: str, step: int, version: int) -> Any:
        description = clicked or asked
        _get_story(desk, step)
        try:
            return desk.trace(description, judge, step) if description else _EMPTY
        except ValueError:  # said beside the map
            return _EMPTY


def _get_story(desk: Desk, step: int) -> Story:
    """Return the story; without the step, which it may have lost since, nothing is updated."""
    story = desk.stage.story
    if not story.first_step <= step <= story.num_steps:
        raise PreventUpdate
    return story


_EMPTY = {
    "data": [],
    "layout": {
        "xaxis": {"visible": False},
        "yaxis": {"visible": False},
        "height": 160,
        "annotations": [{"text": "ask for a thing, or click a dot on the map", "showarrow": False}],
    },
}


def _make_table(table: TextTable) -> html.Div:
    parts: list[Any] = [
        html.H3(table.title),
        html.Table(
            [
                html.Thead(html.Tr([html.Th(name) for name in table.head])),
                html.Tbody([html.Tr([html.Td(cell) for cell in row]) for row in table.rows]),
            ]
        ),
    ]
    if table.note:
        parts.append(html.P(table.note))
    return html.Div(parts)


def _read_view(zoom: dict[str, Any] | None) -> View | None:
    """Return what is on the screen, from what plotly says when the user zooms."""
    keys = [f"{axis}axis.range[{end}]" for axis in "xy" for end in (0, 1)]
    if zoom is None or not all(key in zoom for key in keys):
        return None
    left, right, bottom, top = (float(zoom[key]) for key in keys)
    return left, right, bottom, top
