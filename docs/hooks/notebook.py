"""Runs the notebook of docs/ from its start, and stores what its cells give: python docs/hooks/notebook.py."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import nbformat
from nbclient import NotebookClient
from nbformat import NotebookNode

NOTEBOOK = Path(__file__).parents[1] / "notebook.ipynb"

# Enough to compile all kernels on a slow machine [s].
_LONGEST = 900


def executed() -> NotebookNode:
    """The notebook with the outputs of its cells, which leave no files. CellExecutionError if one fails."""
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    with TemporaryDirectory() as folder:
        # When each cell was run would be another text each time.
        where = {"metadata": {"path": folder}}
        NotebookClient(notebook, timeout=_LONGEST, record_timing=False, resources=where).execute()
    del notebook.metadata["language_info"]  # the version of Python
    return notebook


if __name__ == "__main__":
    nbformat.write(executed(), NOTEBOOK)
