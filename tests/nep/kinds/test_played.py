"""The file of scores beside a table: what commands go on with, and refuse."""

import math

import pytest

from nep import own_home, recorded
from nep.kinds.played import find_scores, load_scores, save_scores


def test_scores_come_back_and_are_nothing_at_first(tmp_path):
    path = find_scores(tmp_path / "new" / "table.md")
    assert path == tmp_path / "new" / "table.json"
    assert load_scores(path) == {}
    save_scores(path, {"home": {"random": {"nll": [math.nan, 1.5]}}})
    ((first, second),) = [own["nll"] for own in load_scores(path)["home"].values()]
    assert math.isnan(first)
    assert second == 1.5


def test_a_folder_is_no_table(tmp_path):
    with pytest.raises(ValueError, match=r"out must be a file, got a folder at .* Name a table"):
        find_scores(tmp_path)


@pytest.mark.parametrize("content", ["[", "[]", '{"a": 1, "a": 2}', "\xff"])
def test_a_damaged_file_is_named(tmp_path, content):
    path = tmp_path / "table.json"
    path.write_bytes(content.encode("latin-1"))
    with pytest.raises(ValueError, match=r"scores must be a JSON object, got .*/table\.json\. Rem"):
        load_scores(path)


@pytest.mark.parametrize("command", [own_home, recorded])
def test_every_table_is_refused_before_playing(command, tmp_path, capsys):
    more = ["--trace", str(tmp_path)] if command is recorded else []
    with pytest.raises(SystemExit):
        command.main(["--out", str(tmp_path), *more])
    assert "out must be a file, got a folder" in capsys.readouterr().err
