"""Every command of tools says what it takes, and refuses in one line what it does not."""

import subprocess

import pytest

from tests.imports import ROOT

COMMANDS = sorted(
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__main__")
    for path in (ROOT / "tools").rglob("*.py")
    if 'if __name__ == "__main__":' in path.read_text("utf-8")
)


def run(python: str, *arguments: str) -> subprocess.CompletedProcess:
    return subprocess.run(
        [python, "-m", *arguments], cwd=ROOT, capture_output=True, text=True, check=False
    )


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_says_what_it_takes(python, command):
    done = run(python, command, "--help")
    assert done.returncode == 0, done.stderr
    assert f"python -m {command}" in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_refuses_what_it_does_not_take(python, command):
    done = run(python, command, "--no_such_option")
    assert done.returncode == 2
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_a_closure_of_no_module_is_one_line(python):
    done = run(python, "tools.closures", "sgm.no_such_file")
    assert done.returncode == 2
    assert done.stderr.startswith("error: module must be one that can be imported, got 'sgm.no_")
    assert done.stderr.count("\n") == 1
