"""Notebooks run from top to bottom, and what is committed of them is clean."""

import ast
import itertools
import re
from pathlib import Path

import nbformat
import pytest
from ipykernel.kernelspec import write_kernel_spec
from nbclient import NotebookClient

from tests.prose import IS_OUT, MOST_WORDS, count_words, list_paragraphs, list_sentences

pytestmark = pytest.mark.slow

REPOSITORY = Path(__file__).resolve().parents[2]
NOTEBOOKS = sorted((REPOSITORY / "notebooks").glob("*.ipynb"))

# Values for the cell tagged "parameters"; a notebook that is not named runs with its own.
SMALL = {
    "01_dynamic_house": {"num_steps": 3, "long": 5, "num_homes": 3, "weeks": 1},
    "02_scene_graph_memory": {"moments": [2, 4], "num_homes": 2, "num_steps": 6},
    "03_train_nep": {"num_homes": 1, "steps": 6, "num_val_homes": 2, "epochs": 1},
    "05_your_own_home": {"days": 2},
}

ABSOLUTE_PATH = re.compile(r"(?<![\w.:/<])/[\w.-]+/[\w.-]+|\b[A-Za-z]:\\\w")

each_notebook = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)


def code_cells(notebook):
    """Cells of code that are not empty."""
    return [cell for cell in notebook.cells if cell.cell_type == "code" and cell.source.strip()]


def shrink(notebook, small):
    """Replace values in the parameters cell."""
    (cell,) = (cell for cell in notebook.cells if "parameters" in cell.metadata.get("tags", []))
    tree = ast.parse(cell.source)
    assigned = {node.targets[0].id: node for node in tree.body if isinstance(node, ast.Assign)}
    assert small.keys() <= assigned.keys(), "SMALL names what the parameters cell does not set"
    for name, value in small.items():
        assigned[name].value = ast.parse(repr(value), mode="eval").body
    cell.source = ast.unparse(tree)


def list_complaints(notebook):
    """Outputs that are errors or went to stderr: tracebacks, warnings, progress bars."""
    return [
        output.get("text") or output.get("evalue")
        for cell in code_cells(notebook)
        for output in cell.outputs
        if output.output_type == "error" or output.get("name") == "stderr"
    ]


def test_there_are_at_most_five_notebooks():
    assert SMALL.keys() <= {path.stem for path in NOTEBOOKS}
    assert len(NOTEBOOKS) <= 5


@each_notebook
def test_a_notebook_asks_a_question_and_ends_with_its_answer(path):
    cells = nbformat.read(path, as_version=4).cells
    title, end = cells[0].source.splitlines()[0], cells[-1]
    assert re.fullmatch(r"# [A-Z].*\?", title)
    assert end.cell_type == "markdown"
    assert end.source.startswith("**Answer.** ")
    pages = (REPOSITORY / "notebooks" / "README.md").read_text("utf-8")
    assert f"[{title.removeprefix('# ')}]({path.name})" in pages


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, id=path.stem, marks=[pytest.mark.dgl] if "from dgl" in text else [])
        for path in NOTEBOOKS
        for text in [path.read_text("utf-8")]
    ],
)
def test_notebook_runs_with_small_settings(path, tmp_path, monkeypatch, python):
    work = tmp_path / "work"
    work.mkdir()
    # This folder is searched first: the kernel is the interpreter that runs the tests.
    command = [python, "-m", "ipykernel_launcher", "-f", "{connection_file}"]
    write_kernel_spec(tmp_path / "kernels" / "python3", {"argv": command})
    monkeypatch.setenv("JUPYTER_PATH", str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", str(REPOSITORY))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    for name in ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR"):
        monkeypatch.setenv(name, str(tmp_path / name))
    notebook = nbformat.read(path, as_version=4)
    notebook.cells.append(nbformat.v4.new_code_cell("import sys; print(sys.executable)"))
    shrink(notebook, SMALL.get(path.stem, {}))
    client = NotebookClient(
        notebook,
        kernel_name="python3",
        resources={"metadata": {"path": str(work)}},
        timeout=1200,
    )
    client.execute()
    assert list_complaints(notebook) == []
    assert notebook.cells[-1].outputs[0].text.strip() == python


@each_notebook
def test_committed_outputs_come_from_one_clean_run(path):
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    cells = code_cells(notebook)
    assert [cell.execution_count for cell in cells] == list(range(1, len(cells) + 1))
    assert list_complaints(notebook) == []
    outputs = [output for cell in cells for output in cell.outputs]
    assert any("image/png" in output.get("data", {}) for output in outputs)


@each_notebook
def test_a_notebook_says_what_one_learns_and_what_each_figure_shows(path):
    cells = nbformat.read(path, as_version=4).cells
    learn = cells[1].source.splitlines()
    assert learn[0] == "**What you learn**"
    assert len([line for line in learn if line.startswith("- ")]) == 3
    for cell, below in itertools.pairwise(cells):
        if any("image/png" in output.get("data", {}) for output in cell.get("outputs", [])):
            assert re.fullmatch(r"\*Figure: [A-Z`][^.]+\.\*", below.source), cell.source


@each_notebook
def test_prose_of_a_notebook_is_plain(path):
    texts = [cell.source for cell in nbformat.read(path, as_version=4).cells]
    kinds = [cell.cell_type for cell in nbformat.read(path, as_version=4).cells]
    for text, kind in zip(texts, kinds, strict=True):
        if kind == "markdown":
            assert IS_OUT.findall(re.sub(r"`[^`]*`", "", text)) == []
            sentences = [s for part in list_paragraphs(text) for s in list_sentences(part)]
            assert [s for s in sentences if count_words(s) > MOST_WORDS] == []


@each_notebook
def test_committed_outputs_are_small_and_name_no_folder_of_a_machine(path):
    assert path.stat().st_size < 1_000_000
    notebook = nbformat.read(path, as_version=4)
    for cell in code_cells(notebook):
        for output in cell.outputs:
            texts = [output.get("text", ""), *map(str, output.get("data", {}).values())]
            if "image/png" in output.get("data", {}):
                texts = [output.data.get("text/plain", "")]
            for text in texts:
                assert not ABSOLUTE_PATH.search(text), text[:500]
                assert "\r" not in text
                assert str(Path.home()) not in text
