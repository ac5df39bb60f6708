"""The command of the searches: plays, goes on where it stopped, and writes the table again."""

import json

import pytest

from tools.searches.suite import main


@pytest.mark.slow
def test_plays_resumes_and_writes_again(tmp_path):
    out = tmp_path / "searches.md"
    small = [
        f"--out={out}",
        "--num_homes=1",
        "--days=1",
        "--searches=2",
        "--looks=1",
        "--checkpoint=any_home",
    ]
    main(small)
    table, scores = out.read_text(encoding="utf-8"), out.with_suffix(".json").read_bytes()
    assert "## Simulated homes of people with routines (1)" in table
    assert table.count("| bayesian |") == 2
    assert (
        "| greedy | greedy, told | search | search, told | search, gives up | everywhere first | "
        in table
    )
    played = json.loads(scores)["scores"]
    assert {player.rpartition(": ")[0] for player in played["people: 12 places-0"]} == {
        "bayesian",
        "adaptive",
        "any_home",
    }
    del played["people: 12 places-0"]["bayesian: search"]
    changed = json.loads(scores) | {"scores": played}
    out.with_suffix(".json").write_text(json.dumps(changed), encoding="utf-8")
    main(small)
    assert (
        json.loads(out.with_suffix(".json").read_bytes())["scores"] == json.loads(scores)["scores"]
    )
    main([f"--out={out}", "--play=false"])
    assert "## Simulated homes of people with routines (1)" in out.read_text(encoding="utf-8")


def test_bad_options_are_one_line(tmp_path, capsys):
    with pytest.raises(SystemExit):
        main([f"--out={tmp_path / 'searches.md'}", "--miss_rate=2"])
    assert "miss_rate must lie in [0, 1], got 2.0" in capsys.readouterr().err
