"""A trace that version 1 wrote of a log is read, and made again from that log to the byte."""

from pathlib import Path

from sgm.memory.look_log import read_log
from simulator.trace import load_trace, save_trace
from simulator.trace.from_log import make_trace

FILES = Path(__file__).parents[2] / "sgm" / "memory" / "earlier_files"


def test_a_trace_of_version_1(tmp_path):
    load_trace(FILES / "trace")
    save_trace(make_trace(read_log(FILES / "looks_v2.jsonl"), "home"), tmp_path / "home")
    save_trace(load_trace(FILES / "trace"), tmp_path / "again")
    for name in ("layout.json", "events.csv"):
        expected = (FILES / "trace" / name).read_bytes()
        assert (tmp_path / "home" / name).read_bytes() == expected
        assert (tmp_path / "again" / name).read_bytes() == expected
