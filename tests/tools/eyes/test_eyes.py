import json

import numpy as np
import pytest

from tools.eyes.__main__ import main
from tools.eyes.results import compute_ratio, format_results

SMALL = (
    "--home.furniture_per_room 2 --home.objects_per_furniture 2 --home.dynamics paper --quiet"
).split()


@pytest.mark.slow
def test_measure_writes_a_table_and_goes_on(tmp_path, capsys):
    out, work = tmp_path / "eyes.md", tmp_path / "work"
    arguments = [
        "--num_homes",
        "1",
        "--rounds",
        "2",
        "--steps",
        "1",
        "--work",
        str(work),
        "--out",
        str(out),
        *SMALL,
    ]
    main(arguments)
    first = capsys.readouterr().out
    assert "| assignment of" in first
    assert out.read_text("utf-8").endswith(first)
    assert {path.name for path in work.glob("*.json")} == {"home_0_looks.json", "home_0_maps.json"}
    path = work / "home_0_looks.json"
    known = json.loads(path.read_text("utf-8"))
    known["noise 0.02"]["num_right"] = 0  # read from the file, not measured again
    path.write_text(json.dumps(known))
    main(arguments)
    assert "right for 0.0%" in capsys.readouterr().out
    main([*arguments, "--parts", '["maps"]'])
    said = capsys.readouterr().out
    assert "| furniture on the map, of" in said
    assert "| assignment of" not in said
    assert """`python -m tools.eyes --parts '["maps"]' --num_homes 1""" in out.read_text("utf-8")
    page = tmp_path / "looks.md"
    page.write_text("# Looks\n\nmade before\n", "utf-8")
    for _ in range(2):  # the section is renewed, not added again
        main([*arguments, "--parts", '["maps"]', "--also", str(page)])
        text = page.read_text("utf-8")
        assert text.startswith("# Looks\n\nmade before\n\n## A robot that starts without a map\n")
        assert text.count("| looks of an errand, without a map and with the true one") == 1
        assert "(eyes.md) has the rest" in text
        assert "pose noise 2 cm" in text
        assert "pose noise 10 cm" not in text
        page.write_text(f"{text}\n## After\n\nkept\n", "utf-8")
    assert page.read_text("utf-8").endswith("\n\n## After\n\nkept\n\n## After\n\nkept\n")


def test_table_by_hand():
    count = {
        "coverage_errors": [0.0, 0.1, -0.02, 0.04], "num_detections": 50, "num_right": 49,
        "num_unassigned": 1, "num_frames": 100, "num_hidden": 7, "num_false_absences": 1,
        "num_gone": 4, "num_absences": 3, "num_gone_in_view": 2, "num_absences_in_view": 2,
        "num_visits": 10, "num_looks": 11,
    }  # fmt: skip
    errands = {
        "eyes": {"found": 0.9, "looks": 2.2, "metres": 3.0},
        "all that shows": {"found": 0.8, "looks": 2.5, "metres": 3.0},
        "perfect looks": {"found": 1.0, "looks": 2.0, "metres": 3.0},
    }
    home = {name: count for name in ("noise 0.0", "noise 0.02", "noise 0.1", "absences")}
    drawn = {
        "num_visible": 20, "num_on_map": 18, "overlaps": [0.5, 0.9], "num_labelled": 9,
        "num_drawn": 25, "num_nowhere": 5, "positions": [0.01, 0.03, 0.2, 0.02],
        "num_misnamed": 1,
    }  # fmt: skip
    home |= {"map 0.02": drawn, "map 0.1": drawn}
    led = {
        "eyes": {"found": 0.8, "looks": 2.0, "metres": 3.0},
        "own map": {"found": 0.7, "looks": 2.2, "metres": 3.0},
    }
    found = {**home, "errands": errands, "errands without a map": led}
    table = format_results([found] * 2)
    assert "pieces that were in view, without a map, after two rounds, pose noise 10 cm" in table
    assert "| 90.0%, 50.0% of it with its label | 90 % |" in table
    assert "| mean 0.700, lowest tenth 0.500 | .6 |" in table
    assert "| 20.0% | 3 % |" in table
    assert "positions of 8 rightly named things of the last round" in table
    assert "| positions whose name is that of another thing, of 10, without a map" in table
    assert "| within 15 cm for 75.0%, median 2.5 cm, highest tenth 20.0 cm | within 15" in table
    assert "0.700 and 0.800: -12.5%, standard error 0.0% | within 10 % |" in table
    assert "2.200 and 2.000: +10.0%, standard error 0.0% | within 15 % |" in table
    assert "coverage of 8 volumes in looks, pose noise 0 cm" in table
    assert "within .05 in 6, mean +0.030, largest error 0.100" in table
    assert "| right for 98.0%, at no place 2.0% | 98 % |" in table
    assert "200 frames | 2 of 14 occluded things | 0 |" in table
    assert "had its spot all in view | 4 of 4 things that had left |" in table
    assert "had its spot in part or not in view | 2 of 4 things that had left |" in table
    assert "looks of a visit of 10 frames, on the way and there | 1.100 | 1 |" in table
    assert "0.900 and 1.000: -10.0%, standard error 0.0%" in table
    assert "2.200 and 2.000: +10.0%" in table
    assert "0.900 and 0.800: +12.5%" in table
    assert "2.200 and 2.500: -12.0%" in table


def test_standard_error_of_a_ratio_by_hand():
    """4 / 5 = .8. The rests 1 - 1.6 and 3 - 2.4 over 2.5 are -.24, .24: .24 sqrt(2) / sqrt(2)."""
    ratio, sd = compute_ratio(np.array([1.0, 3.0]), np.array([2.0, 3.0]))
    assert (ratio, sd) == (pytest.approx(0.8), pytest.approx(0.24))


def test_bad_input_is_one_line():
    with pytest.raises(SystemExit, match="num_homes must be at least 1, got 0"):
        main(["--num_homes", "0", *SMALL])
    with pytest.raises(SystemExit, match="--also must come with --out and the part maps"):
        main(["--also", "results/eyes.md", "--parts", '["looks"]', *SMALL])
