"""The page of scenario files."""

from __future__ import annotations

from docs.generate.scenario_keys import Section, sections

__all__ = ["scenario_page"]

_TOP = """# Scenario files

A scenario is one YAML file that ends in `.scenario.yaml`. Every key is listed here with its unit, its default
and what may stand there; a key that is not listed is refused, with those that are. Lengths are metres,
angles radians, frames those of the [conventions](../conventions.md).
[How to write one](../how_to/own_scenario.md) shows a small one.

`make docs` makes this page from the classes that hold the values; loading checks the same limits.
"""


def scenario_page() -> str:
    """Return the page: one table for each section."""
    return "\n".join([_TOP, *map(_section, sections())])


def _section(section: Section) -> str:
    lines = [
        f"## `{section.path}`" if section.path else "## The file",
        "",
        section.about,
        "",
        "| key | value | default | meaning |",
        "|---|---|---|---|",
    ]
    for key in section.keys:
        kind = f"{key.kind} [{key.unit}]" if key.unit else key.kind
        default = (
            f"`{key.default}`" if key.default not in ("", "see below") else key.default or "**required**"
        )
        cells = (f"`{key.name}`", kind, default, key.meaning)
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join([*lines, ""])
