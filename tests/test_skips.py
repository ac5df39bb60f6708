"""A skip says what is missing: without a reason of its own it fails (tests/conftest.py)."""

from pathlib import Path

pytest_plugins = "pytester"

SKIPS = """
import pytest


def test_named():
    pytest.importorskip("no_such_package", reason="no_such_package is not installed: extra x")


@pytest.mark.skipif(True, reason="needs a robot")
def test_named_by_a_mark():
    pass


def test_unnamed():
    pytest.importorskip("no_such_package")


def test_empty():
    pytest.skip()


@pytest.mark.skip
def test_marked():
    pass


@pytest.mark.skipif("True")
def test_condition():
    pass


@pytest.mark.xfail
def test_that_is_known_to_fail():
    assert False
"""


def test_a_skip_without_a_named_reason_fails(pytester):
    pytester.makeconftest(Path(__file__).with_name("conftest.py").read_text("utf-8"))
    pytester.makepyfile(SKIPS)
    result = pytester.runpytest_inprocess("-p", "no:dash", "-p", "no:cacheprovider")
    # Marks skip while a test is set up, which pytest counts as an error.
    result.assert_outcomes(skipped=2, failed=2, errors=2, xfailed=1)
    result.stdout.fnmatch_lines("*a skip must have a named reason, got*no_such_package*")


def test_a_module_that_is_skipped_without_one_is_an_error(pytester):
    pytester.makeconftest(Path(__file__).with_name("conftest.py").read_text("utf-8"))
    pytester.makepyfile("import pytest\npytest.importorskip('no_such_package')\n")
    result = pytester.runpytest_inprocess("-p", "no:dash", "-p", "no:cacheprovider")
    result.assert_outcomes(errors=1)
