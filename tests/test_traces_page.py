"""docs/traces.md: its files, commands and Python, as they stand there."""

import re
import shlex
from pathlib import Path

import pytest

from simulator.collect import __main__ as collect
from simulator.priors import __main__ as priors
from simulator.trace import __main__ as trace

PAGE = Path(__file__).parents[1].joinpath("docs", "traces.md").read_text(encoding="utf-8")
MODULES = {
    "simulator.collect": collect.main,
    "simulator.priors": priors.main,
    "simulator.trace": trace.main,
}


def find_blocks(language: str) -> list[str]:
    blocks = re.findall(r"^```(\w*)\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL)
    return [text for name, text in blocks if name == language]


@pytest.fixture
def home(tmp_path, monkeypatch) -> Path:
    folder = tmp_path / "home"
    folder.mkdir()
    (layout,), (events,) = find_blocks("json"), find_blocks("csv")
    (folder / "layout.json").write_text(layout, encoding="utf-8")
    (folder / "events.csv").write_text(events, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return folder


def test_commands_run_in_order(home, capsys):
    num_run = 0
    for line in "\n".join(find_blocks("")).splitlines():
        if not line.startswith("python -m") or "import" in line:
            continue  # imports have files of their own in test_trace_importers.py
        _, _, module, *arguments = shlex.split(line)
        extra = ["--workers", "1"] if module == "simulator.collect" else []
        assert not MODULES[module]([*arguments, *extra])
        num_run += 1
    assert num_run == 7
    out = capsys.readouterr().out
    assert "1 homes of at least 48 steps" in out
    assert "types that the prior does not know: hamster\n" in out
    assert "--prior household knows" not in out


def test_check_names_a_prior_that_knows_a_type(home, capsys):
    events = home / "events.csv"
    events.write_text(events.read_text().replace("hamster", "keys"))
    for prior, line in (([], "--prior household knows keys\n"), (["--prior", "household"], "")):
        MODULES["simulator.trace"](["check", "home", *prior])
        out = capsys.readouterr().out
        assert out.endswith(f"does not know: {'keys' if line else 'none'}\n{line}")


def test_the_error_is_as_shown(home):
    events = home / "events.csv"
    events.write_text(events.read_text().replace("milk,fridge,in,\n64", "milk,frige,in,\n64"))
    with pytest.raises(ValueError, match=r"events.csv, row 9: furniture must be in layout.json"):
        trace.load_trace(home)


def test_the_python_of_the_page_runs(home, capsys):
    (recorded,) = find_blocks("python")
    exec(compile(recorded, "traces.md", "exec"), {})
    assert capsys.readouterr().out.startswith("48 [")
