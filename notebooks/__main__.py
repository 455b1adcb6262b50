"""``python -m notebooks DIR``: executes every notebook and writes it with its output into DIR."""

from __future__ import annotations

import sys
from pathlib import Path

import nbformat

from notebooks.execute import HERE, execute


def main(directory: Path) -> None:
    """Execute every notebook beside this file into a directory."""
    directory.mkdir(parents=True, exist_ok=True)
    for path in sorted(HERE.glob("*.ipynb")):
        sys.stderr.write(f"executing {path.name}\n")
        nbformat.write(execute(path), directory / path.name)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
