"""Pages of the API: one for each folder with code, from the docstrings of its modules."""

from __future__ import annotations

import ast
from pathlib import Path

PACKAGES = ("sgm", "simulator", "datamodules", "nep")
FOLDER = "reference/api"


def list_modules(root: Path) -> dict[str, list[str]]:
    """List the modules of each folder by dotted name; command lines are left out."""
    folders: dict[str, list[str]] = {}
    for package in PACKAGES:
        for init in sorted((root / package).rglob("__init__.py")):
            folder = ".".join(init.parent.relative_to(root).parts)
            files = sorted(init.parent.glob("*.py"))
            own = [file.stem for file in files if not file.stem.startswith("__")]
            folders[folder] = [f"{folder}.{name}" for name in own]
    return folders


def make_api_pages(root: Path) -> dict[str, str]:
    """Return the text of each page by its path in the site."""
    pages = {}
    for folder, modules in list_modules(root).items():
        about = ast.get_docstring(
            ast.parse((root / folder.replace(".", "/") / "__init__.py").read_text("utf-8"))
        )
        text = [f"# {folder}", about or "", *list_names(root, folder)]
        text += [f"::: {module}" for module in modules]
        pages[f"{FOLDER}/{folder}.md"] = "\n\n".join(text) + "\n"
    return pages


def list_names(root: Path, folder: str) -> list[str]:
    """Return a list of what a package hands on, with links to where it is described."""
    tree = ast.parse((root / folder.replace(".", "/") / "__init__.py").read_text("utf-8"))
    found = {}
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.ImportFrom)
            and node.module
            and node.module.split(".")[0] in PACKAGES
        ):
            for alias in node.names:
                found[alias.asname or alias.name] = f"{node.module}.{alias.name}"
    rows = [
        f"- [`{name}`][{find_anchor(root, target)}]"
        for name, target in sorted(found.items())
        if name[0].isupper()
    ]
    return ["Names to import from here:", "\n".join(rows)] if rows else []


def find_anchor(root: Path, target: str) -> str:
    """Return where a name is described: itself, or its module if it has no docstring of its own.

    A name that a package hands on is looked for where that has it from.
    """
    module, _, name = target.rpartition(".")
    path = root / module.replace(".", "/")
    is_package = path.is_dir()
    file = path / "__init__.py" if is_package else path.with_suffix(".py")
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module and is_package:
            for alias in node.names:
                if (alias.asname or alias.name) == name:
                    return find_anchor(root, f"{node.module}.{alias.name}")
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)) and node.name == name:
            return target if ast.get_docstring(node) else module
    return module
