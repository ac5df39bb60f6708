"""YAML of files and options: plain values, of no more than it says, in one line otherwise."""

from functools import partial
from itertools import pairwise

import pytest

from nep.fit import main as fit
from simulator.collect.__main__ import main as collect
from simulator.trace.importers.scene_graph import load_label_names
from simulator.yaml_text import load_yaml, parse_yaml

_NAMES = "abcdefghijklm"


def make_bomb(row: str) -> str:
    """Ten aliases in each of twelve lines: 1e12 values."""
    lines = [row.format(new=new, old=", ".join([f"*{old}"] * 10)) for old, new in pairwise(_NAMES)]
    return "\n".join(["a: &a {x: 1}", *lines])


FAULTS = {
    "aliases": (make_bomb("{new}: &{new} [{old}]"), "more than 100000 values"),
    "merges": (make_bomb("{new}: &{new} {{<<: [{old}]}}"), "more than 100000 values"),
    "around": ("&a [*a]", "an alias within what it stands for"),
    "deep": ("[" * 30_000, "nested too deeply"),
    "deep mappings": ("{a: " * 30_000, "nested too deeply"),
    "empty number": ("!!int ''", "a value that cannot be made"),
    "date": ("!!timestamp x", "a value of the kind tag:yaml.org,2002:timestamp"),
    "object": ("!!python/object:os.system x", "a value of the kind .*os.system"),
    "bytes": ("!!binary x", "a value of the kind .*binary"),
    "truth": ("!!bool x", "a value that cannot be made"),
    "key": ("? [a]\n: b", "unhashable key"),
    "digits": ("a: " + "1:" * 5_000 + "1", "a number of 10001 digits"),
    "cut": ("a: [", "line 1|line 2"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_said_in_words(fault):
    text, message = FAULTS[fault]
    with pytest.raises(ValueError, match=message) as raised:
        parse_yaml(text)
    assert "\n" not in str(raised.value)


def test_good_yaml():
    text = "a: &a {x: [1, 2.5, null, true, 'ü']}\nb: *a\nc: {<<: *a, y: 2001-01-01}\n"
    inner = {"x": [1, 2.5, None, True, "ü"]}
    assert parse_yaml(text) == {"a": inner, "b": inner, "c": {**inner, "y": "2001-01-01"}}


@pytest.mark.parametrize(
    "content", [None, b"a: \xff", *(text.encode() for text, _ in FAULTS.values())]
)
def test_a_file_that_cannot_be_read_is_named_in_one_line(content, tmp_path):
    path = tmp_path / "map.yaml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ValueError, match=r"^map must be a file that can be read.*, got ") as raised:
        load_yaml("map", path)
    assert str(path) in str(raised.value)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("fault", FAULTS)
def test_labels_are_read_by_it(fault, tmp_path):
    (tmp_path / "labels.yaml").write_text(FAULTS[fault][0])
    with pytest.raises(ValueError, match=r"labels must be a file .*labels\.yaml"):
        load_label_names(tmp_path / "labels.yaml")


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("command", ["collect", "fit"])
def test_config_files_are_read_by_it(command, fault, tmp_path, capsys):
    path = tmp_path / "odd.yaml"
    path.write_text(FAULTS[fault][0])
    main = {
        "collect": partial(collect, [f"--out={tmp_path}/out", f"--config={path}"]),
        "fit": partial(fit, [f"--config={path}"]),
    }[command]
    with pytest.raises(SystemExit) as stop:
        main()
    errors = f"{capsys.readouterr().err} {stop.value.code}"
    assert "--config must be a YAML file in UTF-8, got" in errors
    assert str(path) in errors


@pytest.mark.parametrize("fault", ["aliases", "deep", "empty number", "object"])
def test_options_are_read_by_it(fault, tmp_path, capsys):
    with pytest.raises(SystemExit) as stop:
        collect([f"--homes={FAULTS[fault][0]}", "--out", str(tmp_path / "out")])
    assert "error: " in f"{capsys.readouterr().err} {stop.value.code}"
