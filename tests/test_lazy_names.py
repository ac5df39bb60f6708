"""Public names of the packages are loaded when they are first used."""

import importlib
import subprocess
import sys

import pytest

PACKAGES = ("sgm", "simulator", "nep")


@pytest.mark.parametrize("name", PACKAGES)
def test_importing_a_package_loads_nothing_heavy(name):
    code = f"import sys, {name}; print(*[m for m in ('numpy', 'torch') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


@pytest.mark.parametrize("name", PACKAGES)
def test_every_public_name_is_there_and_is_found_at_once_again(name):
    package = importlib.import_module(name)
    assert sorted(package._MODULES) == sorted(package.__all__)
    for public in package.__all__:
        value = getattr(package, public)
        assert value is getattr(importlib.import_module(package._MODULES[public]), public)
        assert vars(package)[public] is value


@pytest.mark.parametrize("name", PACKAGES)
def test_another_name_is_an_error_that_says_so(name):
    package = importlib.import_module(name)
    with pytest.raises(AttributeError, match=f"module '{name}' has no attribute 'Nobody'"):
        package.Nobody  # noqa: B018
    with pytest.raises(ImportError, match="cannot import name 'Nobody'"):
        exec(f"from {name} import Nobody")
