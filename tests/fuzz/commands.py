"""Command lines of good and odd options: each ends well, or with one line and a status."""

from __future__ import annotations

import contextlib
import importlib
import io
import json
import os
from pathlib import Path

import numpy as np
import targets

Rng = np.random.Generator
ODD = (
    "",
    "0",
    "-1",
    "1",
    "2",
    "1e-300",
    "1e300",
    "nan",
    "inf",
    "100000000000000000000",
    "x",
    "x" * 3000,
    "[red]x[/nope]",
    "../x",
    "/dev/null/x",
    "null",
    "true",
    "[1,2]",
    "{}",
    "a=b=c",
    "heat",
    "name=heat",
    "bayesian",
    "no_such_module.X",
    "2026-05-04T07:00",
    "\u5bb6",
    "-",
    "--",
)
SMALL = ("--home.furniture_per_room=2", "--home.objects_per_furniture=2")
# Command, what it is called with, and further options that are tried.
COMMANDS = (
    (
        "simulator.collect",
        ("--out=out", "--num_homes=1", "--steps=2", *SMALL),
        (
            "policy task split seed workers homes trace prior step_seconds replays "
            "home.move_share home.detection_error dynamics sensing looks"
        ).split(),
    ),
    ("simulator.trace", ("check", "home"), ("step_seconds", "by_day", "prior")),
    (
        "simulator.trace",
        ("record", "--out=copy", "--num_homes=1", "--steps=2", *SMALL),
        ("step_seconds", "start", "seed", "split", "homes"),
    ),
    ("simulator.trace", ("from-log", "looks.sgm", "--out=log"), ("val_share", "test_share")),
    ("simulator.priors", ("show", "--no_picture"), ("room", "object", "top", "out")),
    (
        "simulator.trace",
        ("import", "procthor", "house.json", "--out=imported"),
        ("furniture", "labels", "start", "memory", "prior"),
    ),
    ("simulator.priors", ("check", "prior.json"), ()),
    ("tools.priors", ("compare", "prior.json", "prior.json"), ("top",)),
    ("simulator.priors", ("from-trace", "home", "--out=counted.json"), ("step_seconds",)),
    (
        "tools.priors",
        ("build", "--source=table=rows.csv", "--out=built.json"),
        "source scope coarse min_edges min_places skip_bad".split(),
    ),
    ("simulator.test_sets", ("show", "paper-32-on-v1"), ()),
    ("simulator.test_sets", ("check", "x"), ()),
    (
        "tools.bench",
        ("igridson", "--out=run.md", "--runs=1", "--queries_per_home=1"),
        ("look_cost", "policy", "attempts", "seed", "layout", "queries_per_home", "prior"),
    ),
    (
        "nep.view",
        ("home.sgm", "--save=page.html"),
        ("ask", "checkpoint", "steps", "number", "seed", "robot", "port", "trace", "prior"),
    ),
    (
        "nep.evaluate",
        (
            "--out=results",
            "--num_homes=1",
            "--steps=2",
            "--policies=bayesian",
            "--tasks=predict_location",
            *SMALL,
        ),
        "policies tasks checkpoint encoders split seed threads trace homes".split(),
    ),
    (
        "nep.export",
        ("last.ckpt", "net", "--num_homes=0"),
        ("steps", "seed", "threads", "encoders", "homes", "trace", "step_seconds"),
    ),
    ("nep.compare", ("results/results.json", "results/results.json"), ()),
    (
        "tools.bench",
        (
            "elsewhere --out=elsewhere.md --kinds=carrying --num_homes=1 --days=1 --play_days=1 "
            "--questions=2"
        ).split(),
        ("checkpoint", "kinds", "trace", "outside", "looks", "seed", "questions"),
    ),
)


def make_inputs(folder: Path) -> None:
    """Write what the commands read."""
    targets.make_trace(folder)
    targets.make_checkpoint(folder)
    targets.make_sources(folder)
    targets.make_memory().save(folder / "home.sgm")
    targets.PriorGraph.default().save(folder / "prior.json")
    memory = targets.SceneGraphMemory(path=folder / "looks.sgm")
    shelf = memory.add_furniture("shelf", memory.add_room("kitchen"))
    for _ in range(20):
        memory.observe(shelf, [targets.Sighting("mug")])
        memory.step()
    module, given, _ = next(row for row in COMMANDS if row[0] == "nep.evaluate")
    (folder / "line").write_text(json.dumps([module, *given]))
    use_line(folder)
    (folder / "line").write_text(json.dumps(["simulator.trace", "check", "home"]))


# What says when to end: left out, a command works for minutes or serves a page, which is no hang.
BOUNDS = tuple(
    (
        "--num_homes --steps --runs --queries_per_home --policies --tasks --source --save --sizes "
        "--days --play_days --questions --learn"
    ).split()
)


def change_line(folder: Path, rng: Rng) -> None:
    """Choose a command line: options are added, repeated, left out or odd."""
    module, given, options = COMMANDS[int(rng.integers(len(COMMANDS)))]
    line = list(given)
    for _ in range(int(rng.integers(1, 4))):
        odd = ODD[int(rng.integers(len(ODD)))]
        kind = rng.integers(5)
        at = int(rng.integers(len(line)))
        if odd == "null" and line[at].startswith(BOUNDS):
            odd = "x"  # "null" is the same as leaving it out
        if kind == 0 and not line[at].startswith(BOUNDS):
            del line[at]
            if not line:
                break
        elif kind == 1 or not options:
            odd = odd.replace("--", "-")  # after it, sizes would be none
            line[at] = f"{line[at].partition('=')[0]}={odd}" if "=" in line[at] else odd
        else:
            name = options[int(rng.integers(len(options)))]
            line += [f"--{name}={odd}"] if kind < 4 else [f"--{name}", odd]
    (folder / "line").write_text(json.dumps([module, *line]))


def use_line(folder: Path) -> None:
    """Run the command line that was chosen."""
    run_line(folder, json.loads((folder / "line").read_text()))


def run_line(folder: Path, words: list[str]) -> None:
    """Run a command in a folder, with what it prints caught.

    Args:
        folder: where it runs.
        words: its module, and what it is called with.
    """
    module, *line = words
    try:
        name = f"{module}.__main__"
        command = importlib.import_module(name)
    except ModuleNotFoundError:
        command = importlib.import_module(module)
    said = io.StringIO()
    back = Path.cwd()
    os.chdir(folder)
    ended = None
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            status = command.main(line)
    except SystemExit as error:
        status, ended = error.code, error
    finally:
        os.chdir(back)
    text = status if isinstance(status, str) else said.getvalue()
    assert isinstance(status, (int, str, type(None))), status
    if status not in (None, 0):
        assert len(text) < 5000, f"{line}: {text[:300]}"
        assert "error" in text, f"{line}: {text[-300:]}"
        raise ValueError(f"a command must say one line: {text.strip()[-200:]}") from ended
