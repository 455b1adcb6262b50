"""The page of the galleries in Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from docs.gallery.cases import Case

_TOP = """# Gallery

`make gallery` runs these transports and takes the stills; `make docs` shows them here. A click on a still
opens the recording.
"""


def gallery_page(galleries: Mapping[str, Sequence[tuple[Case, Mapping[str, Any]]]]) -> str:
    """Return the page: for every heading its cases with the facts that ``coop-drake run --json`` printed."""
    lines = [_TOP]
    for heading, cases in galleries.items():
        lines += [f"## {heading}", ""]
        for case, facts in cases:
            lines += [*_section(case, facts), ""]
    return "\n".join(lines)


def _section(case: Case, facts: Mapping[str, Any]) -> list[str]:
    still = f"![{case.name}]({case.name}.png)"
    if facts["answer"] == "found":
        still = f"[{still}]({case.name}.html)"
    answer = answer_in_words(facts)
    return [f"### {case.name}", "", f"{case.about} {answer}", "", still, "", *_commands(case)]


def _commands(case: Case) -> list[str]:
    scenario = case.name
    lines = []
    if case.new is not None:
        scenario = f"{case.name}/{case.name}.scenario.yaml"
        lines = [f"$ coop-drake new {' '.join((case.name, *case.new))}"]
    elif case.file is not None:
        scenario = f"docs/gallery/{case.file.name}"
    return ["```", *lines, f"$ coop-drake run {scenario}", "```"]


def answer_in_words(facts: Mapping[str, Any]) -> str:
    """Return what came of a case, in a sentence."""
    if facts["answer"] != "found":
        return f"**The planner's answer: {facts['answer']}.** {facts['reason'].capitalize()}."
    if facts["outcome"] != "arrived":
        return f"**Failed**: {facts['violation'] or 'the goal was not reached'}."
    return (
        f"**Arrived after {facts['simulated_seconds']:.1f} s** through {facts['cells']} cells; smallest "
        f"clearance {facts['min_workspace_clearance_m']:.3f} m to walls, "
        f"{facts['min_body_clearance_m']:.3f} m between bodies; object at {facts['peak_speed_m_s']:.2f} m/s "
        "at most."
    )
