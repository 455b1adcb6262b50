"""Pages of the API: one for each room of the house, its public modules one after the other."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import NamedTuple

__all__ = ["ApiPage", "api_pages"]


class ApiPage(NamedTuple):
    """One page.

    Attributes:
        title: The room.
        path: Where the page goes.
        text: Its markdown.
    """

    title: str
    path: str
    text: str


def api_pages(root: Path) -> list[ApiPage]:
    """Pages of all rooms by name, and of the modules outside of rooms.

    Args:
        root: The repository.
    """
    package = root / "coop_drake"
    rooms = sorted(path.parent for path in package.glob("*/__init__.py"))
    alone = sorted(path for path in package.glob("*.py") if path.stem != "__init__")
    pages = [_page(room.name, room / "__init__.py", sorted(room.glob("[!_]*.py"))) for room in rooms]
    return [*pages, _page("coop_drake", package / "__init__.py", alone)]


def _page(title: str, caption: Path, modules: list[Path]) -> ApiPage:
    """A room's caption and its modules, those of compiled inner loops left out."""
    said = ast.get_docstring(ast.parse(caption.read_text(encoding="utf-8"))) or ""
    shown = [path for path in modules if "kernels" not in path.stem]
    names = [".".join((*path.parts[path.parts.index("coop_drake") : -1], path.stem)) for path in shown]
    blocks = "\n\n".join(f"::: {name.replace('coop_drake.coop_drake', 'coop_drake')}" for name in names)
    return ApiPage(title, f"reference/api/{title}.md", f"# {title}\n\n{said}\n\n{blocks}\n")
