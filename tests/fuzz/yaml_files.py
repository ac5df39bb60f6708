"""Files of YAML: labels and options that grow, nest, or name types that nobody expects."""

from __future__ import annotations

from pathlib import Path

import commands
import mutate
import numpy as np

from simulator.trace.importers.scene_graph import load_label_names

Rng = np.random.Generator
LABELS = "label_names:\n- {label: 0, name: unknown}\n- {label: 5, name: chair}\n"
CONFIG = "num_homes: 1\nsteps: 2\nseed: 0\nout: out\nhome:\n  furniture_per_room: 2\n"
FIT = "model:\n  encoder: MLP\ndata:\n  num_homes: 2\n  steps: 2\nseed_everything: 0\n"
# What is read, and by which command; of training, only the options are read.
COMMANDS = (
    ("simulator.collect", "--config=config.yaml", *commands.SMALL),
    ("nep.fit", "--config=fit.yaml", "--print_config"),
    ("nep.evaluate", "--config=config.yaml", "--print_config"),
)
ODD = (
    "!!int ''",
    "!!int x",
    "!!float ''",
    "!!timestamp x",
    "2026-13-45",
    "!!binary '###'",
    "!!set x",
    "!!omap [a]",
    "!!pairs [a]",
    "!!bool x",
    "!!null x",
    "!!merge x",
    "!!value x",
    "!unknown x",
    "!!python/object/apply:os.system ['touch ran']",
    "!!python/name:os.system",
    "&a [*a]",
    "*a",
    "&a {b: *a}",
    "{<<: [{a: 1}, 5]}",
    "{<<: &a {<<: *a}}",
    "? [a, {b: c}]",
    "{[a]: b, {c: d}: e}",
    "1:1:1:1:1:1:1:1:1:1",
    "0x" + "f" * 5000,
    "9" * 5000,
    "1e999",
    ".nan",
    "-.inf",
    "0o17",
    "~",
    "'",
    '"\\x',
    '"\\UFFFFFFFF"',
    "|",
    ">9",
    "@",
    "`",
    "%TAG ! x",
    "\t",
    "\0",
    "\ufeff",
    "--- a\n---",
    "a: 1\na: 2",
    "x" * 100_000,
    "!!str " + "[" * 50 + "]" * 50,
)


def make_good(folder: Path) -> None:
    """Write good files."""
    (folder / "labels.yaml").write_text(LABELS)
    (folder / "config.yaml").write_text(CONFIG)
    (folder / "fit.yaml").write_text(FIT)
    (folder / "line").write_text("0")


def change(folder: Path, rng: Rng) -> None:
    """Change the file that is used."""
    number = int(rng.integers(len(COMMANDS) + 1))
    (folder / "line").write_text(str(number))
    name = "labels.yaml" if number == len(COMMANDS) else COMMANDS[number][1].partition("=")[2]
    path, kind = folder / name, rng.integers(5)
    if kind == 0:
        path.write_bytes(mutate.mutate_text(path.read_bytes(), rng))
    elif kind == 1:
        path.write_text(path.read_text() + make_bomb(rng))
    else:
        odd = ODD[int(rng.integers(len(ODD)))] if rng.random() < 0.6 else nest(rng)
        lines = path.read_text().split("\n")
        at = int(rng.integers(len(lines)))
        key = lines[at].partition(":")[0]
        lines[at] = odd if kind == 2 or not key else f"{key}: {odd}"
        text = odd if rng.random() < 0.2 else "\n".join(lines)
        path.write_text(text, "utf-8", errors="surrogatepass")


def make_bomb(rng: Rng) -> str:
    """Return aliases of aliases: a few lines that are 10**3 to 10**9 values."""
    levels = int(rng.integers(3, 10))
    rows = ["l0: &l0 [x, x, x, x, x, x, x, x, x, x]"]
    for level in range(1, levels):
        repeated = ", ".join([f"*l{level - 1}"] * 10)
        rows.append(f"l{level}: &l{level} [{repeated}]")
    key = str(rng.choice(["label_names", "steps", "home", "policy", "model", "x"]))
    return "\n".join([*rows, f"{key}: *l{levels - 1}", ""])


def nest(rng: Rng) -> str:
    """Return lists or mappings in each other."""
    levels = int(rng.choice([50, 500, 3000, 30_000]))
    kinds = (
        "[" * levels,
        "[" * levels + "]" * levels,
        "{a: " * levels + "1" + "}" * levels,
        "- " * levels + "x",
        "? " * levels,
    )
    return kinds[int(rng.integers(len(kinds)))]


def use(folder: Path) -> None:
    """Read the labels, or run the command."""
    number = int((folder / "line").read_text())
    try:
        if number == len(COMMANDS):
            load_label_names(folder / "labels.yaml")
        else:
            commands.run_line(folder, list(COMMANDS[number]))
    finally:
        assert not (folder / "ran").exists(), "a file was executed"
