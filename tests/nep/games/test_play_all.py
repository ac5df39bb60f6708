"""The runner: who has played does not play again, whoever writes the file, and wherever."""

import json
from dataclasses import dataclass
from typing import ClassVar

import pytest

from nep.games.game import Game, strip_code
from nep.games.play_all import play_all
from nep.games.score_cache import ScoreCache
from nep.report.tables import TableColumn, lay_out
from simulator.command_line import parse
from tools.bench.__main__ import SUITES, main
from tools.bench.recorded import Recorded
from tools.bench.table_options import Option, count, make_command

PLAYERS = {"one": 1.0, "two": 2.0, "three": 3.0}


@dataclass(frozen=True)
class Counting(Game):
    """Scores are numbers that players are, times a factor."""

    factor: float

    scored_by: ClassVar[tuple[str, ...]] = ("nep.games.game",)

    def describe(self):
        return {"factor": self.factor}

    def tell(self):
        return {"title": "Counting", "units": ["a"]}

    def play(self, players):
        return {name: self.factor * value for name, value in players.items()}


class Together(Counting):
    plays_together = True

    def play(self, players):
        return {name: len(players) for name in players}


def play(path, game=Counting(2.0), players=PLAYERS, **options):
    return play_all({"game": game}, lambda game: players, path, **options)


def test_what_has_been_played_stays(tmp_path, capsys):
    path = tmp_path / "table.json"
    assert play(path).scores == {"game": {"one": 2.0, "two": 4.0, "three": 6.0}}
    found = json.loads(path.read_text())
    assert found["about"] == {"game": {"title": "Counting", "units": ["a"]}}
    found["scores"]["game"]["one"] = 77.0
    path.write_text(json.dumps(found))
    capsys.readouterr()
    assert play(path, players={**PLAYERS, "four": 4.0}).scores["game"]["one"] == 77.0
    assert capsys.readouterr().out == "game: four\n"
    with pytest.raises(ValueError, match="got others for game"):
        play(path, Counting(3.0))


def test_scores_of_other_code_are_played_again(tmp_path, capsys):
    path = tmp_path / "table.json"
    play(path)
    found = json.loads(path.read_text())
    found["scores"]["game"]["one"], found["code"]["game"] = 77.0, "0" * 64
    path.write_text(json.dumps(found))
    assert play(path).scores["game"]["one"] == 2.0
    assert "game is scored by other code than in " in capsys.readouterr().out


def test_of_code_only_what_it_computes_counts():
    code = 'def f(x):\n    """Say."""\n    return x  # why\n'
    assert strip_code(code) == strip_code("def f(x):\n    return (x)\n")
    assert strip_code(code) != strip_code("def f(x):\n    return -x\n")


def test_code_is_spelled_alike_on_every_python():
    """Written by hand: Pythons differ in empty fields, in f-strings and in what can be printed."""
    assert strip_code("def f(): return f'{x:{w}}\\u180f'") == (
        "Module(body=[FunctionDef(name='f', args=arguments(), body=[Return(value=JoinedStr("
        "values=[FormattedValue(value=Name(id='x', ctx=Load()), conversion=-1, "
        "format_spec=JoinedStr(values=[FormattedValue(value=Name(id='w', ctx=Load()), "
        "conversion=-1)])), Constant(value='\\u180f')]))])])"
    )


def test_commands_that_share_a_file_lose_nothing(tmp_path):
    path = tmp_path / "table.json"
    first, second = (ScoreCache.load(path, {"game": 1}, {"net": "abc"}) for _ in range(2))
    first.keep("game", {"one": 1.0, "net": 0.5}, "now")
    second.keep("game", {"two": 2.0}, "now")
    assert json.loads(path.read_text())["scores"] == {"game": {"two": 2.0, "one": 1.0, "net": 0.5}}
    third = ScoreCache.load(path, {"game": 1}, {"net": "abcd"})  # another network by now
    third.keep("game", {"net": 0.7}, "now")
    assert json.loads(path.read_text())["scores"]["game"]["net"] == 0.7
    second.keep("game", {"three": 3.0}, "now")  # which holds the scores of the network before
    assert ScoreCache.load(path, {"game": 1}, {}).scores["game"].keys() == {
        "one",
        "two",
        "three",
        "net",
    }


def test_scores_of_a_player_are_a_line_and_what_is_the_same_is_not_written(tmp_path):
    path = tmp_path / "table.json"
    play(path)
    assert '"one": 2.0,\n' in path.read_text()
    before = path.stat().st_mtime_ns
    play(path)
    assert path.stat().st_mtime_ns == before


def test_players_are_played_together_where_a_game_says_so(tmp_path):
    assert play(tmp_path / "a.json", Together(1.0)).scores["game"] == dict.fromkeys(PLAYERS, 3)


@pytest.mark.slow
def test_workers_give_the_same_file(tmp_path):
    play(tmp_path / "a.json")
    play(tmp_path / "b.json", workers=2)
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()


def test_suites_are_commands(capsys):
    assert main(["--help"]) == 0
    lines = capsys.readouterr().out.splitlines()[2 : 2 + len(SUITES)]
    assert [line.split()[0] for line in lines] == [*SUITES]
    assert main(["nothing"]) == 2
    assert "suite must be one of any_home, recorded" in capsys.readouterr().err
    assert main([]) == 2
    with pytest.raises(SystemExit):
        main(["nowhere:main"])
    assert "suite nowhere:main must be found, got No module named" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("suite", SUITES)
def test_every_suite_has_help(suite, capsys):
    with pytest.raises(SystemExit) as ended:
        main([suite, "--help"])
    assert ended.value.code == 0
    said = capsys.readouterr()
    assert "usage: python -m " in said.out
    assert said.err == ""


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        (count("days", 7, ""), 0, "days must be at least 1, got 0"),
        (count("days", 7, ""), 10**5, "days must be at most 10000, got 100000"),
        (Option("share", 0.5, "", 0, 1), 2.0, r"share must lie in \[0, 1\], got 2.0"),
        (Option("sizes", (3, 6), "", 1), (3, 0), "sizes must be at least 1, got 0"),
        (Option("sizes", (3, 6), "", 1), (), "sizes must be at least 1, got 0"),
        (Option("kinds", ("a",), "", known="ab"), ("c",), "kinds must be some of a, b, got 'c'"),
    ],
)
def test_bounds_of_options(option, value, message):
    option.check(option.default)
    with pytest.raises(ValueError, match=message):
        option.check(value)


@pytest.mark.parametrize(
    ("text", "name", "shown"),
    [
        ("any_home", "any_home", "any_home"),
        ("tuned", "tuned", "tuned=FILE"),  # has played: its table is written again
        ("again=heat", "again", "again=FILE"),  # as when it has played
        ("heat=mine.ckpt", "heat", "heat=FILE"),
        ("mine=runs/x/last.ckpt", "mine", "mine=FILE"),
        ("runs/x/last.ckpt", "x", "x=FILE"),
        ("mine.ckpt", "mine.ckpt", "mine=FILE"),
    ],
)
def test_a_command_says_where_a_network_of_ones_own_goes(text, name, shown):
    parser = Recorded().make_parser()
    options = parse(parser, ["--checkpoint", text])
    assert (
        make_command(parser, options, [name])
        == f"python -m tools.bench recorded --checkpoint {shown}"
    )


def test_tables_are_lists_of_columns():
    columns = (TableColumn("who", str), TableColumn("twice", lambda row: str(2 * row)))
    assert lay_out([1, 2], columns) == "| who | twice |\n| --- | ---: |\n| 1 | 2 |\n| 2 | 4 |\n"
