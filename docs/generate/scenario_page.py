"""The pages of scenario files and of campaign files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from coop_drake.campaign.settings import Campaign
from docs.generate.scenario_keys import Section, sections

__all__ = ["campaign_page", "scenario_page"]

_TOP = """# Scenario files

A scenario is one YAML file that ends in `.scenario.yaml`. Every key is listed here with its unit, its default
and what may stand there; a key that is not listed is refused, with those that are. Lengths are metres,
angles radians, frames those of the [conventions](../conventions.md).
[How to write one](../how_to/own_scenario.md) shows a small one.

`make docs` makes this page from the classes that hold the values; loading checks the same limits.
"""


_CAMPAIGN = """# Campaign files

A campaign is one YAML file that ends in `.campaign.yaml`; [how to run one](../how_to/campaign.md). A key that
is not listed is refused. `make docs` makes this page from the classes that hold the values.
"""


def scenario_page() -> str:
    """Return the page of scenario files: one table for each section."""
    return "\n".join([_TOP, *_tables(sections())])


def campaign_page() -> str:
    """Return the page of campaign files, likewise."""
    return "\n".join([_CAMPAIGN, *_tables(sections(Campaign))])


def _tables(found: Iterable[Section]) -> Iterator[str]:
    """Yield the table of every section; sections with the same keys have one, where the first stands."""
    places: dict[tuple[object, ...], list[Section]] = {}
    for section in found:
        places.setdefault((section.about, section.keys), []).append(section)
    for same in places.values():
        yield _section(same[0], [one.path for one in same[1:]])


def _section(section: Section, others: list[str]) -> str:
    also = f"The same keys stand in {', '.join(f'`{path}`' for path in others)}."
    lines = [
        f"## `{section.path}`" if section.path else "## The file",
        "",
        section.about,
        *(["", also] if others else []),
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
