"""The notebooks run, and what they assert is true."""

from __future__ import annotations

from pathlib import Path

import pytest

nbclient = pytest.importorskip("nbclient", reason="runs notebooks")
nbformat = pytest.importorskip("nbformat", reason="reads notebooks")
pytest.importorskip("matplotlib", reason="notebooks draw")
pytest.importorskip("scipy", reason="matrices are scipy's")

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))


def test_both_are_here() -> None:
    assert [path.stem for path in NOTEBOOKS] == ["leak", "spectrum"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_runs(path: Path) -> None:
    notebook = nbformat.read(path, as_version=4)
    shown = [bool(cell.outputs) for cell in notebook.cells if cell.cell_type == "code"]
    nbclient.NotebookClient(notebook, timeout=300).execute()
    assert [bool(cell.outputs) for cell in notebook.cells if cell.cell_type == "code"] == shown, "save it with its outputs"
