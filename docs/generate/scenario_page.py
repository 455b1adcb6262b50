"""The pages of scenario files and of campaign files."""

from __future__ import annotations

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
    return "\n".join([_TOP, *map(_section, sections())])


def campaign_page() -> str:
    """Return the page of campaign files, likewise."""
    return "\n".join([_CAMPAIGN, *map(_section, sections(Campaign))])


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
