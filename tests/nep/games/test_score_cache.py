"""The file of scores beside a table: what commands go on with, and refuse."""

import math

import pytest

from nep.games.score_cache import ScoreCache, find_scores
from tools.bench.__main__ import main


@pytest.fixture
def path(tmp_path):
    return find_scores(tmp_path / "new" / "table.md")


@pytest.fixture
def played(path):
    """A home in which a rule and a network, as it was and adapted, have played for ten steps."""
    played = ScoreCache.load(path, {"home": {"steps": 10}}, {"net": "abc", "net 2": "def"})
    names = ("random", "net", "net adapted", "network", "net 2")
    played.scores["home"].update({name: {"nll": [math.nan, 1.5]} for name in names})
    played.save()
    return played


def test_scores_come_back_and_are_nothing_at_first(path, played):
    assert path.parts[-2:] == ("new", "table.json")
    assert ScoreCache.load(path.with_name("other.json"), {"home": 1}, {}).scores == {"home": {}}
    again = ScoreCache.load(path, {"home": {"steps": 10}, "garden": {}}, {"net": "abc"})
    assert again.scores["home"].keys() == played.scores["home"].keys()
    assert again.scores["garden"] == {}
    first, second = again.scores["home"]["random"]["nll"]
    assert math.isnan(first)
    assert second == 1.5


def test_scores_of_other_options_are_refused(path, played):
    with pytest.raises(ValueError, match=r"scores must be of the same .* got others for home in "):
        ScoreCache.load(path, {"home": {"steps": 11}}, {})
    ScoreCache.load(path, {"garden": {"steps": 11}}, {})  # another game


def test_a_network_that_is_another_one_by_now_plays_again(path, played, capsys):
    again = ScoreCache.load(path, {"home": {"steps": 10}}, {"net": "abcd"})
    assert set(again.scores["home"]) == {"random", "network", "net 2"}
    assert capsys.readouterr().out.startswith("net is another network than that in ")
    again.save()
    assert ScoreCache.load(path, {"home": {"steps": 10}}, {}).networks["net"] == "abcd"


def test_all_is_read_without_homes_and_networks(path, played):
    with pytest.raises(ValueError, match=r"say what they are of, got nothing for home in .*\.json"):
        ScoreCache.load_all(path, None, [])
    played.about["home"] = {"title": "A home", "units": ["a", "a"]}
    played.made["home"] = "commit 1"
    played.save()
    again = ScoreCache.load_all(path, ["home"], ["net"])
    assert (again.about, again.made) == (played.about, played.made)
    with pytest.raises(ValueError, match=r"has played, got 'nobody', which has not played home"):
        ScoreCache.load_all(path, None, ["nobody"])
    with pytest.raises(ValueError, match=r"games must be some of home, got 'garden'"):
        ScoreCache.load_all(path, ["garden"], [])
    with pytest.raises(ValueError, match=r"scores must be a file, got none at .*other\.json"):
        ScoreCache.load_all(path.with_name("other.json"), None, [])


def test_a_folder_is_no_table(tmp_path):
    with pytest.raises(ValueError, match=r"out must be a file, got a folder at .* Name a table"):
        find_scores(tmp_path)


@pytest.mark.parametrize(
    "content",
    [
        "[",
        "[]",
        '{"a": 1, "a": 2}',
        "\xff",
        "{}",
        '{"games": {}, "networks": [], "scores": {}}',
        '{"games": {}, "networks": {}, "scores": {"home": 1}}',
    ],
)
def test_a_damaged_file_is_named(tmp_path, content):
    path = tmp_path / "table.json"
    path.write_bytes(content.encode("latin-1"))
    with pytest.raises(ValueError, match=r"scores must be a JSON object of .*/table\.json\. Rem"):
        ScoreCache.load(path, {}, {})


def test_every_table_is_refused_before_playing(tmp_path, capsys):
    with pytest.raises(SystemExit):
        main(["recorded", "--out", str(tmp_path), "--trace", str(tmp_path)])
    assert "out must be a file, got a folder" in capsys.readouterr().err
