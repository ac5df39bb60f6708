"""What `make docs` adds to the pages of docs/: results, notebooks, tables, commands and the API.

MkDocs reads one folder. Pages that lie elsewhere in the repository, and files that a page links to,
are added here under their path in the repository, and links are written for where they are now.
"""

from __future__ import annotations

import json
import os
import posixpath
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import nbconvert
from mkdocs.plugins import event_priority
from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from docs.make_api import make_api_pages  # noqa: E402
from docs.make_commands import make_command_pages  # noqa: E402
from docs.make_tables import make_table_pages  # noqa: E402
from docs.markdown_math import replace_equations  # noqa: E402

LINK = re.compile(r"(!?\[[^\]]*\]\()([^)\s]+)(\))")
OUTSIDE = ("results/*.md", "benchmarks/README.md", "ros/README.md", "notebooks/README.md")
SINGLE = ("CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md", "CODE_OF_CONDUCT.md")
LANGUAGES = {".py": "python", ".yaml": "yaml", ".json": "json", ".csv": "csv", ".md": "markdown"}
_written = TemporaryDirectory(prefix="site-")  # goes at exit
_made: dict[str, str] = {}  # text of pages that are made here, by their path in the site


def list_outside() -> list[str]:
    """List the pages of the site that lie outside docs/, by their path in the repository."""
    found = [path for pattern in OUTSIDE for path in sorted(ROOT.glob(pattern))]
    return [*(path.relative_to(ROOT).as_posix() for path in found), *SINGLE]


def list_notebooks() -> list[str]:
    """List the notebooks by their path in the repository."""
    return [path.relative_to(ROOT).as_posix() for path in sorted(ROOT.glob("notebooks/*.ipynb"))]


def on_config(config: Any) -> Any:
    """Append results, notebooks, commands and the API to the navigation, and make their pages."""
    _made.clear()
    # Templates of notebooks lie beside nbconvert, also where an environment borrows its packages.
    beside = Path(nbconvert.__file__).parents[4] / "share" / "jupyter"
    os.environ["JUPYTER_PATH"] = os.pathsep.join([os.environ.get("JUPYTER_PATH", ""), str(beside)])
    api, commands, tables = make_api_pages(ROOT), make_command_pages(), make_table_pages()
    _made.update(api | commands | tables)
    parts = {title: pages for part in config["nav"] for title, pages in part.items()}
    parts["Reference"] += [*tables, {"Commands": sorted(commands)}, {"API": list(api)}]
    named = set(list_pages(config["nav"]))
    results = [path for path in list_outside() if path.startswith("results/")]
    parts["Results"] += [path for path in results if path not in named]
    parts["Results"].append({"Notebooks": ["notebooks/README.md", *list_notebooks()]})
    parts["Design"] += SINGLE
    config["nav"] = [{title: pages} for title, pages in parts.items()]
    return config


def list_pages(nav: Any) -> Iterator[str]:
    """List the paths of a navigation."""
    if isinstance(nav, str):
        yield nav
    else:
        for part in nav.values() if isinstance(nav, dict) else nav:
            yield from list_pages(part)


@event_priority(100)  # before the plugin that looks for notebooks
def on_files(files: Any, config: Any) -> Any:
    """Add what lies outside docs/, what is made, and every file that a page links to."""
    outside = list_outside()
    for path in outside:
        files.append(File.generated(config, path, abs_src_path=str(ROOT / path)))
    for path in list_notebooks():
        written = Path(_written.name) / path  # the plugin reads notebooks from disk alone
        written.parent.mkdir(exist_ok=True)
        written.write_text(rewrite_notebook((ROOT / path).read_text("utf-8"), path), "utf-8")
        files.append(File(path, _written.name, config["site_dir"], config["use_directory_urls"]))
    for path, text in _made.items():
        files.append(File.generated(config, path, content=text))
    pages = [ROOT / path for path in outside] + sorted((ROOT / "docs").rglob("*.md"))
    for path in sorted(set().union(*(find_linked_files(page) for page in pages))):
        if path.endswith((".png", ".gif")):
            files.append(File.generated(config, path, abs_src_path=str(ROOT / path)))
        elif files.get_file_from_path(to_site(path)) is None:
            files.append(File.generated(config, to_site(path), content=show_file(path)))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Write the links of a page for the site, and its equations as MathML."""
    path = page.file.src_uri
    if path in _made or path in list_notebooks():
        return markdown
    source = path if page.file.generated_by else f"docs/{path}"
    return replace_equations(replace_links(markdown, lambda link: move_link(link, source)))


def replace_links(markdown: str, change: Callable[[str], str]) -> str:
    """Replace the targets of all links outside of code."""
    lines, is_code = [], False
    for line in markdown.split("\n"):
        if line.lstrip().startswith("```"):
            is_code = not is_code
        if not is_code:
            line = LINK.sub(lambda match: match[1] + change(match[2]) + match[3], line)
        lines.append(line)
    return "\n".join(lines)


def find_target(link: str, source: str) -> str:
    """Return the path in the repository that a link of a page names, "" of an address or anchor."""
    path = link.partition("#")[0]
    if not path or ":" in path:
        return ""
    return posixpath.normpath(posixpath.join(posixpath.dirname(source), path))


def to_site(path: str) -> str:
    """Return where a file of the repository is in the site."""
    if path == "README.md":
        return "index.md"
    if path.startswith("docs/") and not path.endswith(".py"):
        return path.removeprefix("docs/")
    if path in list_outside() or path in list_notebooks() or path.endswith((".png", ".gif")):
        return path
    if (ROOT / path).is_dir():
        return f"{path}/README.md"
    return f"source/{path}.md"


def move_link(link: str, source: str) -> str:
    """Return a link of a page as the site needs it."""
    target = find_target(link, source)
    if not target or (source.startswith("docs/") and target.startswith("docs/")):
        return link
    anchor = link.partition("#")[2]
    if target == "README.md":
        anchor = ""
    here = source.removeprefix("docs/") if source.startswith("docs/") else source
    moved = posixpath.relpath(to_site(target), posixpath.dirname(here) or ".")
    return f"{moved}#{anchor}" if anchor else moved


def find_linked_files(page: Path) -> set[str]:
    """Return files of the repository that a page links to and that are no pages."""
    source, found = page.relative_to(ROOT).as_posix(), set()

    def note(link: str) -> str:
        target = find_target(link, source)
        if target and not target.startswith("docs/") and (ROOT / target).is_file():
            found.add(target)
        return link

    replace_links(page.read_text("utf-8"), note)
    return found - {"README.md", *list_outside(), *list_notebooks()}


def show_file(path: str) -> str:
    """Return a page that shows a file of the repository."""
    language = LANGUAGES.get(Path(path).suffix, "text")
    return f"# {path}\n\n````{language}\n{(ROOT / path).read_text('utf-8')}\n````\n"


def rewrite_notebook(text: str, source: str) -> str:
    """Return a notebook whose links lead to pages of the site."""
    notebook = json.loads(text)
    for cell in notebook["cells"]:
        if cell["cell_type"] == "markdown":
            cell["source"] = replace_links(
                "".join(cell["source"]),
                lambda link: re.sub(r"\.(md|ipynb)(?=#|$)", ".html", move_link(link, source)),
            )
    return json.dumps(notebook)
