"""What the reader of a page has beside it, what is made smaller, and what is not run here."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import torch

from tests.guides import ROOT, Shell, list_blocks

_FIT = (
    "--data.num_homes 2 --data.steps 4 --data.num_val_homes 1 --data.batch_size 4 "
    "--data.workers 1 --online.policies [] --online.num_homes 1 --online.steps 1 --threads 1 "
    "--trainer.enable_progress_bar false"
)
# Options behind those of a command, of which the last one counts: what takes hours takes seconds.
# A training has one epoch where the page does not say how many, and recorded homes are all played.
_EPOCHS = 'case "$*" in *max_epochs*) ;; *) echo --trainer.max_epochs 1 ;; esac'
_HOMES = 'case "$*" in *--trace*) ;; *) echo --num_homes 2 --steps 4 ;; esac'
SMALLER = {
    "-m nep.fit": f"$({_EPOCHS}) {_FIT}",
    "sweep.py": f"{_FIT} --trainer.max_epochs 1",
    "-m nep.evaluate": f"$({_HOMES}) --workers 1",
    "-m nep.export": "--num_homes 1 --steps 1 --threads 1",
    "-m nep.reproduce": "--table figure --tiny --workers 1",
    "-m tools.bench elsewhere": (
        "--num_homes 1 --days 1 --play_days 1 --questions 2 --kinds routine"
    ),
    "-m tools.bench igridson": "--runs 20 --queries_per_home 10",
    "-m nep.igridson video": "--searches 1 --warm_up 1 --tile 32",
    "-m simulator.igridson video": "--searches 1 --warm_up 1 --tile 32",
    "-m simulator.collect": f"$({_HOMES}) --workers 1",
    "-m simulator.box_world": "--home.furniture_per_room 2 --steps 1 --errands_per_step 1",
}
# Pages whose commands are small, and run as they stand; the second time their trainings are short.
AS_IT_STANDS = ("docs/extend/", "docs/start/")
SHORTER = {"-m nep.fit": "--trainer.max_epochs 1 --online.policies []"}
# Numbers of a page's Python, with smaller ones.
SMALLER_TEXT = {
    "docs/research.md": {"n_trials=20": "n_trials=2"},
    "docs/rl.md": {
        "learn(60_000)": "learn(256)",
        "learn(20_000)": "learn(256)",
        "n_envs=8": "n_envs=2",
        "n_steps=256": "n_steps=64",
        "n_steps=128": "n_steps=64",
        "batch_size=256": "batch_size=64",
        "num_homes=10, num_searches=20": "num_homes=1, num_searches=2",
    },
    "docs/scale.md": {
        "range(1000)": "range(2)",
        "num_steps=100": "num_steps=2",
        "workers=8": "workers=1",
    },
}
_IMPORTED = "tests/simulator/trace/test_trace_importers.py has files of the program"
# Lines that are not run, by how they begin, with the reason or the test that runs them.
NOT_RUN = {
    "CONTRIBUTING.md": [(".ci/run", "all of the checks")],
    "benchmarks/README.md": [("python benchmarks/", "tests/benchmarks/test_benchmarks.py")],
    "notebooks/README.md": [(".venv/bin/", "opens a browser and waits")],
    "ros/README.md": [("", "needs ROS 2; make ros-test")],
    "docs/agents.md": [("claude mcp add", "needs Claude Code")],
    "docs/any_home.md": [("python -m nep.fit", "hours; tests/tools/bench/test_any_home.py")],
    "docs/box_world.md": [("python -m tools.eyes", "tests/tools/eyes/test_eyes.py")],
    "docs/database.md": [("sqlite3", "a program; tests/docs/test_database.py runs the queries")],
    "docs/igridson.md": [("python -m simulator.igridson play", "needs a screen and keys")],
    "docs/importers.md": [
        ("python -m simulator.trace import procthor", _IMPORTED),
        ("python -m simulator.trace import spark-dsg", _IMPORTED),
        (
            "python -m simulator.trace import virtualhome",
            "tests/simulator/trace/test_virtualhome.py",
        ),
        (
            "python -m simulator.trace import home-assistant",
            "tests/simulator/trace/test_home_assistant.py",
        ),
        ("python -m simulator.trace import frigate", "tests/simulator/trace/test_frigate.py"),
        ("python -m simulator.trace import coco", "tests/simulator/trace/test_coco.py"),
        ("python -m simulator.trace import hd_epic", "tests/simulator/trace/test_hd_epic.py"),
    ],
    "docs/priors.md": [
        ("python -m tools.priors build", "minutes, or data of others"),
        ("python -m tools.priors compare", "needs the prior of the line before it"),
    ],
    "docs/robot/leaving.md": [
        ("python -m tools.bench elsewhere --kinds carrying --trace", "needs recorded homes"),
    ],
    "docs/scale.md": [
        ("python -m simulator.compile", "minutes; tests/simulator/test_kernel_store.py"),
        ("ray start", "changes the machine"),
        ("RAY_ADDRESS", "needs the cluster of the line before it"),
    ],
    "docs/text.md": [("python -m tools.text_training", "minutes")],
    "docs/worlds.md": [("python -m nep.reproduce", "hours; tests/nep/reproduce/test_reproduce.py")],
    "docs/traces.md": [
        ("python -m tools.bench recorded", "hours; tests/tools/bench/test_recorded.py")
    ],
}
# Pages whose program has ended before a command reads its files.
PROGRAM_ENDS = ("docs/eyes.md", "docs/robot.md")
# Pages whose Python prints what is in files of the reader.
PRINTS_OTHER = ("docs/bags.md", "docs/scale.md")
# What a page prints, beside what stands in it.
SHOWS = {
    "docs/bags.md": r"in home(.|\n)*\d looks",
    "docs/evaluate.md": r"Two Guesses(.|\n)*MyPolicy \| bayesian",
    "docs/events.md": r"epoch 4: first guess 0\.\d+, MRR 0\.\d",
    "docs/extend/column_of_the_memory.md": r"\('mug',\) \[1\]\nobjects\.num_asked\n(.|\n)*"
    r"features of an edge: 10\nmost looks that did not show it: [1-9]",
    "docs/extend/dynamics.md": r'"name": "shuffle.Shuffle",\n *"share": 0.2\n',
    "docs/extend/feature.md": r"crowded +0\.\d+",
    "docs/extend/importer_of_recorded_homes.md": r"placed: 2 rooms, 3 furniture nodes, 4 objects",
    # of 32 places, ties averaged: the MRR of no opinion is below .1, of one that is free it is 1
    "docs/extend/metric.md": r"\| mrr \| rank above 1 \|(.|\n)*\| random \|.*\| 0\.0\d\d \| 1\.00 ",
    "docs/extend/model.md": r"my_model +0\.\d+",
    "docs/extend/policy.md": r"most_seen:MostSeen +0\.\d+",
    "docs/extend/prior_source.md": r"diary: 12 read(.|\n)*kitchen",
    "docs/extend/sensing.md": r'"name": "dark.DarkInside",\n *"inside": 0.6,\n *"on_top": 0.1\n',
    "docs/extend/source_of_homes.md": r"3 unseen flats x 5 steps(.|\n)*NEP +0\.\d+(.|\n)*3 test fl",
    "docs/extend/suite.md": r"16 places(.|\n)*\| any_home \| 0\.\d+(.|\n)*Played with",
    "docs/extend/task.md": r"Two Guesses",
    "docs/research.md": r"\| 0 \| \d\.\de-0\d \| [124] \|(.|\n)*\d\.\d{3} ± \d\.\d{3} over 3 seeds",
    "docs/rl.md": r"trained:Trained +\d\.\d\d(.|\n)*\| MaskablePPO \| \d\.\d{3} \|",
    "docs/serve.md": r'"name":"desk in study"(.|\n)*look at desk in study',
    "docs/start/benchmark.md": r"\| any_home \|(.|\n)*\| persistence \| bayesian \|",
    "docs/start/researcher.md": r"\| heat \|(.|\n)*\| mine \||\| mine \|(.|\n)*\| heat \|",
    "docs/traces.md": r"do(?:es)? not know: hamster",
}


def follow_readme(folder: Path, shell: Shell) -> None:
    """Leave what README's twenty lines leave: `home.sgm`."""
    blocks = list_blocks((ROOT / "README.md").read_text("utf-8"))
    (lines,) = [block.text for block in blocks if block.language == "python"]
    (folder / "twenty_lines.py").write_text(lines, "utf-8")
    shell.run("python twenty_lines.py")


def record(folder: Path, shell: Shell) -> None:
    """Leave a recording of a robot that looks at a table twice."""
    from tests.simulator.trace.test_bag import write_recording

    others = ("/yolo", "/boxes", "/in_map")  # `/all` is then the only one of its type
    write_recording(folder / "RECORDING", "SQLITE3", ("/detections", *others), None, is_gone=False)


def split_homes(folder: Path, shell: Shell) -> None:
    """Leave a recorded home to train in, and one for validation and test."""
    for block in list_blocks((ROOT / "docs" / "traces.md").read_text("utf-8")):
        if block.saved and block.saved.startswith("home/"):
            for number, split in enumerate(("train", "val", "test")):
                own = folder / "homes" / split / "one"
                own.mkdir(parents=True, exist_ok=True)
                text = block.text.replace("\n27000,", f"\n{27000 + 600 * number},")  # another day
                (own / Path(block.saved).name).write_text(text, "utf-8")


def check_research(folder: Path) -> None:
    """Hold the trainings of docs/research.md to what the page says of them."""
    runs = folder / "runs"
    assert (folder / "sweep.db").is_file()
    epochs = [
        torch.load(runs / "heat" / version / "checkpoints" / "last.ckpt", weights_only=True)[
            "epoch"
        ]
        for version in ("version_0", "version_1")
    ]
    assert epochs == [1, 3]  # counted from 0: two, and as many more
    table = (runs / "logged" / "version_0" / "metrics.csv").read_text("utf-8")
    assert "val/hits_at_1" in table
    assert list((runs / "logged").rglob("events.out.tfevents*"))
    offline, *_ = (runs / "wandb").glob("offline-run-*")
    pictures = {path.name.rpartition("_")[0] for path in offline.rglob("media/images/**/*.png")}
    assert {"accuracy_over_steps", "calibration"} <= {name.rpartition("_")[0] for name in pictures}
    for seed in (0, 1, 2):
        config = (runs / "seeds" / f"seed_{seed}" / "config.yaml").read_text("utf-8")
        assert f"\nseed_everything: {seed}\n" in f"\n{config}"
    configs = [path.read_text("utf-8") for path in (runs / "heat").glob("*/config.yaml")]
    assert any("precision: bf16-mixed" in config for config in configs)


# What is looked at in the folder after a page was followed once.
CHECKS = {"docs/research.md": check_research}
FILES: dict[str, tuple[Callable[[Path, Shell], None], ...]] = {
    "docs/agents.md": (follow_readme,),
    "docs/mcap.md": (follow_readme,),
    "docs/bags.md": (record,),
    "docs/traces.md": (split_homes,),
}
