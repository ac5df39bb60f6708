"""docs/traces.md: what its home is checked for, and the error that it shows."""

import re
from pathlib import Path

import pytest

from simulator.trace import __main__ as trace

PAGE = Path(__file__).parents[1].joinpath("docs", "traces.md").read_text(encoding="utf-8")


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


def test_check_names_a_prior_that_knows_a_type(home, capsys):
    events = home / "events.csv"
    events.write_text(events.read_text().replace("hamster", "keys"))
    for prior, line in (([], "--prior household knows keys\n"), (["--prior", "household"], "")):
        trace.main(["check", "home", *prior])
        out = capsys.readouterr().out
        assert out.endswith(f"does not know: {'keys' if line else 'none'}\n{line}")


def test_the_error_is_as_shown(home):
    events = home / "events.csv"
    events.write_text(events.read_text().replace("milk,fridge,in,\n64", "milk,frige,in,\n64"))
    with pytest.raises(ValueError, match=r"events.csv, row 9: furniture must be in layout.json"):
        trace.load_trace(home)
