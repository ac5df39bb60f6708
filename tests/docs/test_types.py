"""The Python of all guides as a user's mypy sees it: no error."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.guides import DOCS

ROOT = DOCS.parent
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
# A block of Python; before it the name of the file that the reader saves it as, if any.
BLOCK = re.compile(
    r"(?:ave this as `(?P<saved>[\w/]+)\.py`[^\n]*\n\n)?^```python\n"
    r"(?P<code>(?:# (?P<named>[\w/]+)\.py\n)?.*?)^```",
    re.MULTILINE | re.DOTALL,
)
# Bodies are checked, annotated or not, which is more than mypy does unless it is asked to.
SETTINGS = "# mypy: check-untyped-defs, allow-untyped-defs"


def write_modules(folder: Path) -> list[Path]:
    """Write the code of every page to files, each block on the lines that it has in its page.

    A file that a page says to save has that name, and the name of the page before it where another
    page saves one, too. A block without a name goes on where the block before it ended.
    """
    modules: dict[str, list[str]] = {}
    for page in PAGES:
        name = str(page.relative_to(ROOT))
        title = "page_" + re.sub(r"\W", "_", name.removesuffix(".md"))
        heads = {title: [SETTINGS]}
        text, module = page.read_text("utf-8"), title
        for found in BLOCK.finditer(text):
            saved = (found["saved"] or found["named"] or "").rpartition("/")[2]
            if saved:
                module = f"{title}_{saved}" if saved in modules else saved
            lines = heads.setdefault(module, [SETTINGS])
            start = text.count("\n", 0, found.start("code"))
            assert len(lines) <= start, f"{name} must have a title before its first block"
            lines += [""] * (start - len(lines)) + found["code"].splitlines()
            modules[module] = lines
    files = [folder / f"{module}.py" for module in modules]
    for file, lines in zip(files, modules.values(), strict=True):
        file.write_text("\n".join(lines) + "\n", "utf-8")
    return files


@pytest.mark.slow
def test_mypy_finds_no_error_in_the_code_of_any_page(tmp_path):
    """In the repository, with what `make check` has read already."""
    pytest.importorskip("mypy", reason="mypy is not installed: extra dev")
    files = write_modules(tmp_path)
    done = subprocess.run(
        [sys.executable, "-m", "mypy", *files],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
