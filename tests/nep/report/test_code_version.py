"""Which code made a table."""

import subprocess
from importlib.metadata import version

from nep.report import results as code_version
from nep.report.results import describe_code, find_commit, list_versions


def run_git(*arguments):
    done = subprocess.run(["git", *arguments], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_a_checkout_says_its_commit():
    commit = find_commit()
    assert run_git("rev-parse", "HEAD").startswith(commit.removesuffix("+changes"))
    assert list_versions()["commit"] == commit
    assert list_versions()["numpy"] == version("numpy")
    assert describe_code().endswith(f", commit {commit}")


def test_a_repository_that_the_package_only_lies_in_is_not_taken_for_its_own(tmp_path, monkeypatch):
    find_commit.cache_clear()
    package = tmp_path / "environment" / "nep" / "report" / "code_version.py"
    package.parent.mkdir(parents=True)
    package.touch()
    subprocess.run(["git", "init", "-q", str(tmp_path)], check=True)
    monkeypatch.setattr(code_version, "_CHECKOUT", package.parents[2])
    monkeypatch.setattr(code_version, "__file__", str(package))
    try:
        assert find_commit() is None
        assert "commit" not in list_versions()
    finally:
        find_commit.cache_clear()


def test_an_edited_checkout_says_so(tmp_path, monkeypatch):
    find_commit.cache_clear()
    package = tmp_path / "nep" / "report" / "code_version.py"
    package.parent.mkdir(parents=True)
    package.touch()
    git = ["git", "-C", str(tmp_path), "-c", "user.name=a", "-c", "user.email=a@b"]
    for arguments in (["init", "-q"], ["add", "."], ["commit", "-q", "-m", "one"]):
        subprocess.run([*git, *arguments], check=True)
    monkeypatch.setattr(code_version, "_CHECKOUT", tmp_path)
    monkeypatch.setattr(code_version, "_CODE", ("nep",))
    monkeypatch.setattr(code_version, "__file__", str(package))
    try:
        clean = find_commit()
        package.write_text("# edited")
        find_commit.cache_clear()
        assert find_commit() == f"{clean}+changes"
    finally:
        find_commit.cache_clear()
