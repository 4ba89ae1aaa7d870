"""The notebook of docs/ runs from its start, and what is stored with it is what it gives."""

import runpy
from pathlib import Path

import nbformat
import pytest

import particlesim as ps

DOCS = Path(ps.__file__).parents[1] / "docs"
NOTEBOOK = DOCS / "notebook.ipynb"


def code(notebook):
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def kinds(cell):
    """Which outputs there are, and in what forms each of them is."""
    return [(output.output_type, sorted(output.get("data", {}))) for output in cell.outputs]


@pytest.mark.slow
def test_every_cell_runs_and_gives_what_is_stored_with_it():
    fresh = runpy.run_path(str(DOCS / "hooks" / "notebook.py"))["executed"]()
    stored = nbformat.read(NOTEBOOK, as_version=4)
    assert [cell.source for cell in code(fresh)] == [cell.source for cell in code(stored)]
    assert [kinds(cell) for cell in code(fresh)] == [kinds(cell) for cell in code(stored)]


def test_it_shows_a_movie_a_figure_and_the_viewer_and_is_small():
    forms = [form for cell in code(nbformat.read(NOTEBOOK, as_version=4)) for form in kinds(cell)]
    shown = [form for _, form in forms]
    assert ["image/png", "text/html", "text/plain"] in shown  # a movie, and its poster
    assert ["image/png", "text/plain"] in shown  # a figure, though the notebook has no pyplot
    assert ["text/html", "text/plain"] in shown  # the viewer
    assert "error" not in [kind for kind, _ in forms]
    assert NOTEBOOK.stat().st_size < 1e6
