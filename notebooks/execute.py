"""Executes notebooks from top to bottom in a fresh kernel."""

from __future__ import annotations

from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbformat import NotebookNode

__all__ = ["HERE", "execute"]

HERE = Path(__file__).parent


def execute(path: Path, *, timeout: float = 600.0) -> NotebookNode:
    """Execute a notebook in its own folder and return it with its output.

    Args:
        path: The notebook.
        timeout: Longest time for one cell [s].

    Raises:
        nbclient.exceptions.CellExecutionError: A cell failed.
    """
    notebook = nbformat.read(path, as_version=4)
    client = NotebookClient(notebook, timeout=timeout, resources={"metadata": {"path": str(path.parent)}})
    return client.execute()
