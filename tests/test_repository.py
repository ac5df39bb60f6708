"""What helps others to join: public CI, hooks, forms, citation, compose; they say what is so."""

import configparser
import re
import subprocess
from pathlib import Path

import pytest
import yaml

from sgm.serve.__main__ import DEFAULT_PORT, TOKEN_VARIABLE
from tests.imports import ROOT
from tests.prose import list_paragraphs, list_sentences

FORMS = sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml"))
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
ALL = [
    *FORMS,
    *WORKFLOWS,
    *(ROOT / name for name in (".github/dependabot.yml", ".pre-commit-config.yaml",
                               "CITATION.cff", "compose.yaml")),
]  # fmt: skip


def read(path):
    return yaml.safe_load((ROOT / path).read_text("utf-8"))


def list_steps(name):
    jobs = read(f".github/workflows/{name}.yml")["jobs"].values()
    return [step for job in jobs for step in job["steps"]]


def list_runs(name):
    return [step["run"] for step in list_steps(name) if "run" in step]


HOSTS = re.compile(r"(pypi|pythonhosted|anaconda|download\.pytorch)\.org|(ghcr|docker|quay)\.io")
TEXTS = {".cfg", ".cff", ".ipynb", ".md", ".py", ".toml", ".txt", ".xml", ".yaml", ".yml"}


@pytest.mark.parametrize("path", ALL, ids=lambda path: path.name)
def test_every_file_is_yaml(path):
    assert read(path)


def test_no_file_names_the_host_of_a_registry():
    """Packages come from where pip is set up to look."""
    folders = [path for path in ROOT.iterdir() if path.name[0] != "." or path.name == ".github"]
    files = [
        path
        for top in folders
        for path in ([top] if top.is_file() else top.rglob("*"))
        if path.suffix in TEXTS or path.name in ("Dockerfile", "Makefile")
    ]
    assert {ROOT / "README.md", ROOT / "Makefile", *WORKFLOWS} < set(files)
    found = [
        path
        for path in files
        if not {"build", "site"} & set(path.parts[len(ROOT.parts) :])
        and path != Path(__file__)
        and HOSTS.search(path.read_text("utf-8"))
    ]
    assert found == []


def test_public_ci_runs_what_contributors_run():
    assert list_runs("ci").count(".ci/run") == 1
    assert "make docs" in list_runs("docs")
    assert "make dist" in list_runs("release")
    makefile = (ROOT / "Makefile").read_text("utf-8")
    runs = [run for name in ("ci", "docs", "release") for run in list_runs(name)]
    targets = re.findall(r"\bmake ([a-z -]+)", "\n".join(runs))
    for target in " ".join(targets).split():
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target


def test_workflows_may_read_alone_but_where_something_is_published():
    for path in WORKFLOWS:
        workflow = read(path)
        assert workflow["permissions"] == {"contents": "read"}
        for name, job in workflow["jobs"].items():
            assert ("permissions" in job) == (name == "publish"), path
            assert "${{ secrets" not in str(job)


def test_ci_tries_pythons_that_the_packages_declare():
    settings = configparser.ConfigParser()
    settings.read(ROOT / "core" / "setup.cfg", encoding="utf-8")
    declared = re.findall(r"Python :: (3\.\d+)", settings["metadata"]["classifiers"])
    jobs = read(".github/workflows/ci.yml")["jobs"]
    tried = {*jobs["core"]["strategy"]["matrix"]["python"], "3.11"}
    assert tried == set(declared)


def test_a_tag_that_is_not_the_version_ends_the_release(tmp_path):
    (script,) = [
        step["run"] for step in list_steps("release") if step.get("name", "").startswith("The tag")
    ]
    version = re.search(r"^version = (.*)$", (ROOT / "setup.cfg").read_text("utf-8"), re.M)[1]
    for tag, status in ((f"v{version}", 0), ("v9.9.9", 1), (version, 1)):
        done = subprocess.run(
            ["bash", "-e", "-c", script],
            cwd=ROOT,
            env={"GITHUB_REF_NAME": tag, "PATH": "/usr/bin:/bin"},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == status, done
        assert (f"got {tag}." in done.stdout) == bool(status)


def test_hooks_are_the_linters_of_make_check():
    check = re.search(r"^check:.*\n((?:\t.*\n)+)", (ROOT / "Makefile").read_text("utf-8"), re.M)[1]
    linters = re.findall(r"-m (.+?)(?: \.)?\n", check)
    (repository,) = read(".pre-commit-config.yaml")["repos"]
    entries = [
        hook["entry"].replace(" --force-exclude", "").partition(" -m ")[2]
        for hook in repository["hooks"]
    ]
    assert entries == linters == ["ruff check", "ruff format --check", "mypy"]


def test_the_citation_is_that_of_the_readme():
    readme, citation = (ROOT / "README.md").read_text("utf-8"), read("CITATION.cff")
    paper = citation["preferred-citation"]
    assert f"{{{paper['title']}}}" in readme
    authors = re.search(r"author    = \{(.*?)\},\n", readme, re.DOTALL)[1]
    names = [name.split(",")[0].strip() for name in re.split(r"\s+and\s+", authors)]
    spelled = [name.replace("{\\'\\i}", "í") for name in names]
    assert [author["family-names"] for author in paper["authors"]] == spelled
    settings = configparser.ConfigParser()
    settings.read(ROOT / "setup.cfg", encoding="utf-8")
    metadata = settings["metadata"]
    assert (citation["version"], citation["license"]) == (metadata["version"], metadata["license"])
    assert citation["authors"] == [{"name": metadata["author"]}]
    assert metadata["url"] == paper["url"]


def test_the_code_of_conduct_has_three_sentences():
    page = (ROOT / "CODE_OF_CONDUCT.md").read_text("utf-8")
    assert len([s for part in list_paragraphs(page) for s in list_sentences(part)]) == 3


def test_compose_starts_the_image_with_its_token_and_port():
    service = read("compose.yaml")["services"]["sgm"]
    assert service["build"] == "."
    assert list(service["environment"]) == [TOKEN_VARIABLE]
    assert service["ports"] == [f"127.0.0.1:{DEFAULT_PORT}:{DEFAULT_PORT}"]
    image = (ROOT / "Dockerfile").read_text("utf-8")
    (volume,) = service["volumes"]
    assert f"VOLUME {volume.partition(':')[2]}" in image


def test_forms_ask_for_what_is_needed():
    for path in FORMS:
        form = read(path)
        if path.name == "config.yml":
            continue
        assert {"name", "description", "body"} <= form.keys()
        ids = [part["id"] for part in form["body"] if part["type"] != "markdown"]
        assert len(ids) == len(set(ids)) >= 2
