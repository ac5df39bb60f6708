"""Values in messages are cut; nothing makes it fail."""

import re
from pathlib import Path

import pytest

from sgm.messages import needed_to, shorten, shorten_values, tell_missing

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (3, "3"),
        ("a", "'a'"),
        ("x" * 300, "'" + "x" * 196 + "..."),
        ([0] * 300, "a list of 300"),
        ({"a": "y" * 500}, "{'a': '" + "y" * 190 + "..."),
    ],
)
def test_a_value_has_at_most_200_characters(value, text):
    assert shorten(value) == text
    assert len(text) <= 200


def test_a_number_that_python_refuses_to_write_is_described():
    assert shorten(10**5000) == "a number of about 5000 digits"


def test_values_within_a_message_are_cut_and_the_rest_stays():
    message = f"time must be a number, got '{'x y ' * 100}' and {'z' * 300} here. Mend it."
    assert shorten_values(message) == (
        f"time must be a number, got '{'x y ' * 50}...' and {'z' * 200}... here. Mend it."
    )
    assert shorten_values("short, got 'a b' here") == "short, got 'a b' here"


def test_no_message_repeats_a_whole_value():
    """What is no message is written by `repr`."""
    found = [
        f"{path.relative_to(ROOT)}: {line.strip()}"
        for package in ("simulator", "datamodules", "nep")
        for path in (ROOT / package).rglob("*.py")
        for line in path.read_text(encoding="utf-8").splitlines()
        if re.search(r"\{[^{}]+!r\}", line)
    ]
    assert found == [], "write {shorten(value)} instead of {value!r}"


def test_lists_in_lists_are_not_written_as_often_as_they_stand_there():
    """Ten lists of ten lists of ten ... : 1e30 parts, which `repr` would write."""
    value = ["x"] * 10
    for _ in range(30):
        value = [value] * 10
    assert shorten(value) == "a list of 10"
    assert shorten({"a": value}) == "a dict of 1"
    around: list[object] = []
    around.append(around)
    assert shorten(around) == "a list of 1"
    assert shorten(["x" * 20_000]) == "a list of 1"


def test_a_missing_package_is_told_with_what_installs_it():
    with (
        pytest.raises(ModuleNotFoundError) as error,
        needed_to("read bags", extra="bag"),
    ):
        import no_such_package.inner  # noqa: F401
    assert error.value.name == "no_such_package"
    assert str(error.value) == (
        "package no_such_package must be installed to read bags, got none. "
        "Run pip install ./core '.[bag]'."
    )
    assert tell_missing("x", "serve", extra="serve").endswith("Run pip install './core[serve]'.")
    assert tell_missing("PIL", "draw", install="pillow").endswith("Run pip install pillow.")
