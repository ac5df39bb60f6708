"""What is installed: two distributions of one version, their files, and the image of the server."""

import ast
import configparser
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tarfile
import urllib.request
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

import sgm
from sgm.messages import tell_missing
from sgm.serve.__main__ import make_parser

ROOT = Path(__file__).resolve().parents[1]
IGNORED = shutil.ignore_patterns("__pycache__", "*.egg-info", "build")
PIP = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]


def read_settings(path: str) -> configparser.ConfigParser:
    settings = configparser.ConfigParser()
    settings.read(ROOT / path, encoding="utf-8")
    return settings


def read_requirements(settings) -> dict[str, str]:
    lines = settings["options"]["install_requires"].split("\n")
    pairs = [re.match(r"([\w.-]+)(?:\[\w+\])?(.*)", line) for line in lines if line]
    return {found[1]: found[2].strip() for found in pairs}


def test_both_have_one_version():
    research, core = read_settings("setup.cfg"), read_settings("core/setup.cfg")
    version = research["metadata"]["version"]
    assert version == sgm.__version__
    assert read_requirements(research)["scene-graph-memory-core"] == f"=={version}"
    assert research["options"]["python_requires"] == core["options"]["python_requires"]
    for name in ("author", "author_email", "url", "license", "project_urls"):
        assert research["metadata"][name] == core["metadata"][name]
    shared = read_requirements(core).items() & read_requirements(research).items()
    assert len(shared) >= 2  # one range where both need a package
    both = read_requirements(core).keys() & read_requirements(research).keys()
    assert {name for name, _ in shared} == both


@pytest.mark.parametrize("name", ["LICENSE", "NOTICE", "README.md"])
def test_what_both_say_alike_is_one_file(name):
    """A copy of README would go on saying what README no longer does."""
    assert (ROOT / "core" / name).is_symlink()
    assert (ROOT / "core" / name).samefile(ROOT / name)


@pytest.mark.parametrize("python", ["3.12", "3.13"])
def test_pip_installs_both_on_a_python_that_dgl_has_no_wheels_for(python):
    """`pip install ./core .` ended in a list of versions that fit no Python but 3.11."""
    named = []
    for path in ("setup.cfg", "core/setup.cfg"):
        settings = read_settings(path)
        assert python in SpecifierSet(settings["options"]["python_requires"])
        versions = settings["metadata"]["classifiers"]
        assert f"Programming Language :: Python :: {python}" in versions
        lines = settings["options"]["install_requires"].split("\n")
        for line in filter(None, (line.partition("#")[0].strip() for line in lines)):
            requirement = Requirement(line)
            marker = requirement.marker
            if marker is None or marker.evaluate({"python_version": python}):
                named.append(requirement.name)
    assert "torch" in named
    assert "dgl" not in named


def test_no_message_says_to_install_what_no_index_has():
    for folder in ("sgm", "simulator", "datamodules", "nep", "ros"):
        for path in (ROOT / folder).rglob("*.py"):
            text = path.read_text("utf-8")
            assert not re.search(r"pip install '?\"?scene-graph-memory", text), path


def test_every_package_is_typed():
    for package in ("sgm", "simulator", "datamodules", "nep"):
        assert (ROOT / package / "py.typed").is_file()


@pytest.mark.slow
def test_wheels_from_sdists_share_no_file(tmp_path):
    """Each sdist is unpacked where the repository is not, and a wheel is built from it."""
    pytest.importorskip("build", reason="build is not installed: extra dev")
    source = tmp_path / "source"
    source.mkdir()
    for name in ("core", "sgm", "simulator", "datamodules", "nep"):
        shutil.copytree(ROOT / name, source / name, symlinks=True, ignore=IGNORED)
    for path in ROOT.iterdir():
        if path.is_file():
            shutil.copy(path, source)
    for folder in (source / "core", source):
        build = [sys.executable, "-m", "build", "--no-isolation", "--quiet", "--sdist"]
        subprocess.run([*build, "--outdir", tmp_path, folder], check=True, capture_output=True)
    for sdist in tmp_path.glob("*.tar.gz"):
        with tarfile.open(sdist) as archive:
            archive.extractall(tmp_path / "unpacked", filter="data")
    shutil.rmtree(source)
    owned = {}
    for folder in sorted((tmp_path / "unpacked").iterdir()):
        wheel = [*PIP, "wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", tmp_path]
        subprocess.run([*wheel, folder], check=True)
    for wheel in tmp_path.glob("*.whl"):
        with zipfile.ZipFile(wheel) as archive:
            names = set(archive.namelist())
            (metadata,) = (name for name in names if name.endswith("/METADATA"))
            text = archive.read(metadata).decode()
        assert "# Scene Graph Memory" in text
        assert not re.search(r"\]\((?!https?:)", text)  # a link that leads nowhere on an index
        assert {f"{metadata[:-8]}licenses/{name}" for name in ("LICENSE", "NOTICE")} <= names
        owned[wheel.name.partition("-")[0]] = {n for n in names if ".dist-info/" not in n}
    core, research = owned["scene_graph_memory_core"], owned["scene_graph_memory"]
    assert {name.partition("/")[0] for name in core} == {"sgm"}
    assert {name.partition("/")[0] for name in research} == {"simulator", "datamodules", "nep"}
    for package in ("sgm", "simulator", "datamodules", "nep"):
        files = [path for path in (ROOT / package).rglob("*") if path.is_file()]
        kept = {str(p.relative_to(ROOT)) for p in files if "__pycache__" not in p.parts}
        assert kept == {name for name in core | research if name.startswith(f"{package}/")}


def read_dockerfile() -> list[list[str]]:
    text = (ROOT / "Dockerfile").read_text("utf-8").replace("\\\n", "")
    lines = [line.split(maxsplit=1) for line in text.splitlines() if line and line[0] != "#"]
    return [[word, rest] for word, rest in lines]


def test_the_image_starts_a_server_that_there_is():
    lines = dict(read_dockerfile())
    entry, arguments = json.loads(lines["ENTRYPOINT"]), json.loads(lines["CMD"])
    commands = read_settings("core/setup.cfg")["options.entry_points"]["console_scripts"]
    assert f"{entry[0]} = sgm.serve.__main__:main" in commands
    options = make_parser().parse_args(arguments)
    assert str(options.port) == lines["EXPOSE"]
    version = lines["FROM"].removeprefix("python:").removesuffix("-slim")
    classifiers = read_settings("core/setup.cfg")["metadata"]["classifiers"]
    assert f"Programming Language :: Python :: {version}\n" in classifiers


@pytest.mark.slow
def test_the_image_installs_from_what_it_copies(tmp_path):
    for word, rest in read_dockerfile():
        if word == "COPY":
            *sources, target = rest.split()
            for name in sources:
                assert f"!{name}" in (ROOT / ".dockerignore").read_text("utf-8").split("\n")
                if (ROOT / name).is_dir():
                    shutil.copytree(ROOT / name, tmp_path / target, symlinks=True, ignore=IGNORED)
                else:
                    shutil.copy(ROOT / name, tmp_path / target)
        elif rest.startswith("pip "):
            words = shlex.split(rest)
            assert words[:2] == ["pip", "install"]
            assert words[-1] == "./core[serve]"
    install = [*PIP, "install", "--no-deps", "--no-build-isolation", "--target", tmp_path / "to"]
    subprocess.run([*install, "./core[serve]"], cwd=tmp_path, check=True)
    lines = dict(read_dockerfile())
    (entry,), arguments = json.loads(lines["ENTRYPOINT"]), json.loads(lines["CMD"])
    command = [tmp_path / "to" / "bin" / entry, *arguments, "--port", "0"]  # the last one counts
    home = tmp_path / "home"
    home.mkdir()
    variables = os.environ | {"PYTHONPATH": str(tmp_path / "to"), "HOME": str(home)}
    variables.pop("SGM_TOKEN", None)
    refused = subprocess.run(command, cwd=home, env=variables, capture_output=True, text=True)
    assert refused.returncode == 2
    assert "set SGM_TOKEN" in refused.stderr
    token = "of-sixteen-characters"
    with subprocess.Popen(
        command, cwd=home, env=variables | {"SGM_TOKEN": token}, stdout=subprocess.PIPE, text=True
    ) as server:
        try:
            port = re.search(r":(\d+)/$", server.stdout.readline())[1]
            request = urllib.request.Request(
                f"http://127.0.0.1:{port}/health", headers={"Authorization": f"Bearer {token}"}
            )
            with urllib.request.urlopen(request, timeout=30) as answer:
                assert answer.status == 200
            health = json.loads(lines["HEALTHCHECK"].partition("CMD")[2])
            asked = [word.replace(":8600/", f":{port}/") for word in health]
            assert asked != health
            subprocess.run([sys.executable, *asked[1:]], check=True)
        finally:
            server.terminate()  # as `docker stop` does
        assert server.wait(timeout=30) == 0
    assert (home / "home.sgm").is_file()


def test_missing_packages_are_told_in_one_way():
    """By `needed_to` or `tell_missing`, with extras that the package has which is named."""
    settings = read_settings("setup.cfg")
    found = []
    for package in ("sgm", "simulator", "datamodules", "nep"):
        for path in (ROOT / package).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                    if node.func.id in ("needed_to", "tell_missing"):
                        found += [(word.value, path) for word in node.keywords]
                    text = ast.unparse(node) if node.func.id.endswith("Error") else ""
                    assert "./core" not in text, f"{path}: use needed_to"
    extras = {value.value for value, path in found if isinstance(value, ast.Constant)}
    named = {extra for extra in extras if extra in settings["options.extras_require"]}
    assert {"serve", "mcap", "hub", "frame", "spark", "bag", "gym", "events"} <= named
    assert extras - named == {"pillow", "pyyaml", "matplotlib", "rich", "'spacy>=3.8,<4'"}
    core = read_settings("core/setup.cfg")
    for extra in named:
        is_core = extra in core["options.extras_require"]
        assert ("'./core[" in tell_missing("x", "run", extra=extra)) == is_core
