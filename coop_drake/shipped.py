"""Finds the shipped models and scenarios: beside the package in a checkout, inside it where installed."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent
_SUFFIX = ".scenario.yaml"

SHIPPED = next(
    (f for f in (_PACKAGE / "models", _PACKAGE.parent / "models") if f.is_dir()), _PACKAGE / "models"
)
"""Folder of the shipped models and scenarios."""


def shipped_scenarios() -> dict[str, Path]:
    """Return the files of the shipped scenarios by name."""
    return {path.name.removesuffix(_SUFFIX): path for path in sorted(SHIPPED.glob("*" + _SUFFIX))}


def scenario_file(given: Path | str) -> Path:
    """Return the file given, the only scenario file of the folder given, or the shipped one of that name."""
    path = Path(given)
    if path.is_dir():
        inside = list(path.glob("*" + _SUFFIX))
        if len(inside) == 1:
            return inside[0]
    elif path.exists():
        return path
    return shipped_scenarios().get(str(given), path)
