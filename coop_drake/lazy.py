"""Names of a package that are imported when they are first used, as its stub lists them (PEP 562)."""

from __future__ import annotations

import ast
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any


def lazy_names(package: str, file: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Make what ``__getattr__``, ``__dir__`` and ``__all__`` of a package shall be.

    Args:
        package: Name of the package.
        file: Its ``__init__.py``; ``__init__.pyi`` beside it imports each name from a module of the package.
    """
    stub = ast.parse(Path(file).with_suffix(".pyi").read_text(encoding="utf-8"))
    imports = [node for node in stub.body if isinstance(node, ast.ImportFrom)]
    modules = {alias.name: f"{package}.{node.module}" for node in imports for alias in node.names}

    def get(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(modules[name]), name)
        setattr(import_module(package), name, value)  # It is found without this function from now on.
        return value

    return get, lambda: sorted(modules), sorted(modules)
