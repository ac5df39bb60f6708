import ast
import subprocess
import sys
from pathlib import Path

import pytest

from sgm.compiled.kernel import kernel

FOLDER = Path(__file__).parents[2] / "simulator" / "compiled"


def test_importing_the_simulator_does_not_load_numba():
    code = "import sys, simulator; assert 'numba' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True, cwd=FOLDER.parents[1])


@pytest.mark.parametrize("file", sorted(FOLDER.glob("*.py")), ids=lambda file: file.stem)
def test_kernels_call_functions_of_their_own_file_alone(file):
    """What is kept on disk would not notice that another file has changed."""
    found = set()
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("simulator"):
            found.add(node.module)
    assert found <= {"sgm.compiled.kernel"}


def test_a_function_that_cannot_be_kept_is_compiled_all_the_same():
    namespace = {}
    exec("def double(number):\n    return 2 * number", namespace)  # no file, so nowhere to keep it
    double = kernel(namespace["double"])
    assert double(21) == 42
    assert double.nopython_signatures
