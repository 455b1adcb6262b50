"""Pages of the API: one for each package, with its public modules."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import NamedTuple


class ApiPage(NamedTuple):
    """One page.

    Attributes:
        title: Name of the package.
        path: Path of the page.
        text: Its markdown.
    """

    title: str
    path: str
    text: str


def api_pages(root: Path) -> list[ApiPage]:
    """Return the pages of all packages by name, then that of the modules outside of them.

    Args:
        root: The repository.
    """
    package = root / "coop_drake"
    packages = sorted(path.parent for path in package.glob("*/__init__.py"))
    alone = sorted(path for path in package.glob("*.py") if path.stem != "__init__")
    pages = [_page(inner.name, inner / "__init__.py", sorted(inner.glob("[!_]*.py"))) for inner in packages]
    return [*pages, _page("coop_drake", package / "__init__.py", alone)]


def _page(title: str, caption: Path, modules: list[Path]) -> ApiPage:
    """Return the page of a package: its docstring, and its modules except those of compiled inner loops."""
    said = ast.get_docstring(ast.parse(caption.read_text(encoding="utf-8"))) or ""
    shown = [path for path in modules if "kernels" not in path.stem]
    names = [".".join((*path.parts[path.parts.index("coop_drake") : -1], path.stem)) for path in shown]
    blocks = "\n\n".join(f"::: {name.replace('coop_drake.coop_drake', 'coop_drake')}" for name in names)
    return ApiPage(title, f"reference/api/{title}.md", f"# {title}\n\n{said}\n\n{blocks}\n")
