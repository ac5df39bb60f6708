"""Code of guides that have no test of their own: as it stands there, in small homes."""

import re
import urllib.request

import matplotlib as mpl
import matplotlib.pyplot as plt
import pytest

from tests.guides import read_page
from tests.sgm.serve.conftest import open_service, run_server


def find_blocks(page: str) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```$", read_page(page), re.MULTILINE | re.DOTALL)


@pytest.mark.slow
def test_snapshots_are_read_as_in_data(tmp_path, monkeypatch):
    from simulator.collect.__main__ import main

    monkeypatch.chdir(tmp_path)
    main(["--num_homes", "1", "--steps", "4", "--out", "DIR", "--workers", "1"])
    (code,) = [block for block in find_blocks("data.md") if "SnapshotDataset" in block]
    names: dict = {}
    exec(compile(code, "data.md", "exec"), names)
    assert names["snapshots"].num_snapshots == 3
    assert names["graph"].num_nodes("house") == 3


def test_the_grid_is_made_as_in_igridson():
    pytest.importorskip("minigrid", reason="minigrid is not installed: extra igridson")
    names: dict = {}
    (code,) = find_blocks("igridson.md")
    exec(compile(code, "igridson.md", "exec"), names)
    assert names["observation"]["mission"].startswith("find the ")


@pytest.mark.slow
def test_homes_are_shared_out_as_in_scale():
    (code,) = find_blocks("scale.md")
    small = code.replace("range(1000)", "range(2)").replace("num_steps=100", "num_steps=2")
    small = small.replace("workers=8", "workers=1")
    names: dict = {}
    exec(compile(small, "scale.md", "exec"), names)
    assert names["scores"].home_values.shape == (2,)


def test_vectors_are_made_as_in_text():
    (code,) = find_blocks("text.md")
    lines = [line for line in code.splitlines() if not line.startswith("TextVectors(")]
    names: dict = {}
    exec(compile("\n".join(lines), "text.md", "exec"), names)
    assert names["text"].cosines(["mug", "cup"]).shape == (2, 2)


@pytest.mark.slow
def test_the_blocks_of_view_open_a_page_and_draw_a_log(tmp_path, monkeypatch):
    """As a reader has them: one after the other in one folder, and all of it a second time."""
    monkeypatch.chdir(tmp_path)
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    for _ in range(2):
        names: dict = {}
        with mpl.rc_context({"backend": "agg"}):
            for code in find_blocks("view.md"):
                exec(compile(code, "view.md", "exec"), names)
            assert len(plt.get_fignums()) == 3
            plt.close("all")
        assert names["before"].time == 120
        with urllib.request.urlopen(opened.pop()) as page:
            assert page.status == 200


def test_an_agent_asks_as_in_agents(tmp_path, capsys):
    pytest.importorskip("mcp", reason="mcp is not installed: extra serve")
    (code,) = find_blocks("agents.md")
    home, service = open_service(tmp_path / "home.sgm")
    with run_server(service, home) as running:
        here = code.replace("127.0.0.1:8600", f"127.0.0.1:{running.port}")
        here = here.replace("the red mug", "the large red mug")
        assert here.count(str(running.port)) == 1
        exec(compile(here, "agents.md", "exec"), {})
    assert capsys.readouterr().out == "desk in study\n"


def test_a_map_of_bags_is_read_as_it_stands_there(tmp_path):
    from simulator.trace.importers.bag import load_home_map

    (text,) = re.findall(r"^```yaml\n(.*?)^```$", read_page("bags.md"), re.MULTILINE | re.DOTALL)
    (tmp_path / "map.yaml").write_text(text)
    home = load_home_map(tmp_path / "map.yaml")
    assert home.frame == "map"
    assert len(home.furniture) == 4  # and the floor of a room
