"""`make docs` builds the site: every module and command is in it, and nothing of elsewhere."""

import re
import subprocess
from pathlib import Path
from urllib.parse import unquote

import pytest

ROOT = Path(__file__).resolve().parents[2]
# What a browser would fetch by itself: scripts, style sheets, pictures, fonts.
FETCHED = re.compile(r"<(?:script|link|img|iframe)\b[^>]*?\b(?:src|href)=[\"']?(https?:[^\"' >]+)")


@pytest.fixture(scope="module")
def site(tmp_path_factory, python):
    """The site, built as `make docs` does: a warning is an error."""
    for package in ("mkdocs_jupyter", "mkdocstrings_handlers.python", "material"):
        pytest.importorskip(package, reason=f"{package} is not installed: extra docs")
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [python, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)],
        cwd=ROOT,
        env={
            "PYTHONPATH": str(ROOT),
            "PATH": "",
            "HOME": str(folder),
            "NO_MKDOCS_2_WARNING": "1",
        },
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


@pytest.mark.slow
def test_every_module_and_command_has_its_place(site):
    missing = []
    for package in ("sgm", "nep", "simulator", "datamodules"):
        for path in (ROOT / package).rglob("*.py"):
            module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
            if path.stem in ("__init__", "__main__"):
                continue
            folder = module.rpartition(".")[0]
            page = (site / "reference" / "api" / f"{folder}.html").read_text("utf-8")
            missing += [module] if f'id="{module}"' not in page else []
    assert missing == []
    api = (site / "reference" / "api" / "sgm.html").read_text("utf-8")
    for name in ("ObjectFinder", "SceneGraphMemory", "Bayesian"):
        assert f">{name}<" in api
    play = (site / "reference" / "commands" / "simulator.box_world.html").read_text("utf-8")
    assert "--looks_per_step" in play


@pytest.mark.slow
def test_every_entry_of_the_menu_has_a_title(site):
    """On pages that show the whole menu of their part."""
    for page, fewest in (("results.html", 25), ("robot.html", 25), ("design.html", 6)):
        text = (site / page).read_text("utf-8")
        entries = re.findall(r'<a href="([^"#]+)" class="md-nav__link">\s*(.*?)</a>', text, re.S)
        titles = {link: re.sub(r"<[^>]+>|\s+", " ", inner).strip() for link, inner in entries}
        assert len(titles) > fewest
        assert {"None", ""}.isdisjoint(titles.values())
    results = (site / "results.html").read_text("utf-8")
    for title in ("a home of your own?", "Benchmarks", "Scripted households"):
        assert title in results
    assert "A node for ROS 2" in (site / "robot.html").read_text("utf-8")


@pytest.mark.slow
def test_no_link_of_a_page_is_broken(site):
    broken = []
    for page in site.rglob("*.html"):
        if page.name == "404.html":
            continue  # its links start at the root of a server
        for link in set(re.findall(r'(?:href|src)="([^"#]+)', page.read_text("utf-8"))):
            is_there = re.match(r"\w+:|//", link) or (page.parent / unquote(link)).exists()
            broken += [] if is_there else [f"{page.relative_to(site)}: {link}"]
    assert broken == []


@pytest.mark.slow
def test_nothing_is_fetched_from_elsewhere(site):
    pages = list(site.rglob("*.html"))
    assert len(pages) > 120
    foreign = {url for page in pages for url in FETCHED.findall(page.read_text("utf-8"))}
    foreign = {url for url in foreign if "squidfunk" not in url}  # a link of the footer
    assert foreign == set()
    styles = "".join(path.read_text("utf-8") for path in site.rglob("*.css"))
    assert re.findall(r"url\([\"']?https?:", styles) == []
    assert (site / "search" / "search_index.js").is_file()
    assert (site / "assets" / "iframe-worker.js").is_file()


@pytest.mark.slow
def test_results_notebooks_and_linked_files_are_in_the_site(site):
    assert (site / "results" / "table_1.html").is_file()
    notebook = (site / "notebooks" / "05_your_own_home.html").read_text("utf-8")
    assert "jp-Cell" in notebook
    belief = (site / "concepts" / "belief.html").read_text("utf-8")
    assert "<math" in belief
    assert "$$" not in belief
    guide = (site / "any_home.html").read_text("utf-8")
    assert 'href="source/nep/configs/any_home.yaml.html"' in guide
