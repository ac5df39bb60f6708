"""Builds the API pages from docstrings, as a static site: `make docs`. A warning is an error."""

from __future__ import annotations

import argparse
import importlib
import pkgutil
import warnings
from collections.abc import Iterator
from pathlib import Path

import pdoc
import pdoc.render

PACKAGES = ("sgm", "nep", "simulator", "datamodules")


def list_modules() -> Iterator[str]:
    """List all modules but the command lines of packages, which run when they are imported."""
    for package in PACKAGES:
        yield package
        folders = importlib.import_module(package).__path__
        for module in pkgutil.walk_packages(folders, f"{package}."):
            if not module.name.endswith("__main__"):
                yield module.name


def main() -> None:
    """Write the site."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("site"), help="folder of the site")
    out = parser.parse_args().out
    warnings.simplefilter("error")
    # pdoc finds the modules of packages without `__all__` by itself, and only of those.
    warnings.filterwarnings("ignore", message="The module specification")
    # torch_geometric 2.8 compiles with torch.jit.script when imported; torch 2.13 deprecated that.
    warnings.filterwarnings("ignore", message=".torch.jit.script. is deprecated")
    import nep
    import sgm

    for package in (sgm, nep):  # names are loaded when first used, and pdoc shows what is loaded
        for name in package.__all__:
            getattr(package, name)
    pdoc.render.configure(docformat="google", show_source=False)
    pdoc.pdoc(*list_modules(), output_directory=out)
    print(f"{out / 'index.html'}: {len(list(out.rglob('*.html')))} pages")


if __name__ == "__main__":
    main()
