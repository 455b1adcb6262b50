"""A diagnosis in rows and sentences."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees
from typing import Any

from coop_drake.answers.plan import MixedCell
from coop_drake.diagnosis.changes import Relaxation
from coop_drake.diagnosis.contacts import BodyAtFault
from coop_drake.diagnosis.diagnosing import BlockedPose, Diagnosis, PassageFindings
from coop_drake.diagnosis.variants import Answer, Bracket, OpenFloor
from coop_drake.diagnosis.widening import BlockingPassage
from coop_drake.tree.pose import FloatArray

# The cells that an undecided search proved neither free nor blocked, and which key to change.

SHOWN = 3
"""Cells that are described, the widest first [-]."""


def mixed_sentences(cells: Sequence[MixedCell]) -> list[str]:
    """Where mixed cells, the widest first, remained, and which keys of ``planner`` to change."""
    sentences = [
        f"{len(cells)} cells on the last channel were proved neither free nor blocked; "
        f"the widest spans {100.0 * cells[0].width_fraction:.2g} % of an axis."
    ]
    for cell in cells[:SHOWN]:
        x_min, y_min, x_max, y_max = cell.polygon.bounds
        sentences.append(
            f"One is x {x_min:.3f} to {x_max:.3f} m, y {y_min:.3f} to {y_max:.3f} m, {_intervals(cell)}."
        )
    if all(cell.finest for cell in cells):
        sentences.append(
            "They are below the resolution: lower planner.angle_resolution and planner.length_resolution."
        )
    else:
        sentences.append("They could be halved further: raise planner.max_slices.")
    return sentences


def _intervals(cell: MixedCell) -> str:
    robots = f" of robots {', '.join(map(str, cell.robots))}" if cell.robots else ""
    theta, *joints = (f"{low:.4f} to {high:.4f}" for low, high in zip(cell.lower, cell.upper, strict=True))
    return f"theta {theta} rad" + (f", joints{robots} {', '.join(joints)}" if joints else "")


def mixed_facts(cell: MixedCell) -> dict[str, Any]:
    """A mixed cell in plain numbers."""
    return {
        "robots": list(cell.robots),
        "bounds": [float(value) for value in cell.polygon.bounds],
        "lower": [float(value) for value in cell.lower],
        "upper": [float(value) for value in cell.upper],
        "share_of_axis": cell.width_fraction,
        "below_resolution": cell.finest,
    }


# A diagnosis in sentences, as rows of a table, and as plain numbers.

Row = tuple[str, str]


def sentences_of(diagnosis: Diagnosis) -> list[str]:
    """The findings in sentences; they say what is proved and what was merely found."""
    if diagnosis.answer is Answer.FOUND:
        return ["Feasible: a channel was found."]
    known = "Infeasible, proved" if diagnosis.answer is Answer.INFEASIBLE else "Undecided"
    sentences = [f"{known}: {diagnosis.reason}."]
    if diagnosis.mixed:
        sentences += mixed_sentences(diagnosis.mixed)
    if diagnosis.goal is not None:
        sentences += _goal_sentences(diagnosis.goal)
    if diagnosis.passages is not None:
        sentences += _passage_sentences(diagnosis.passages)
    return sentences


def _passage_sentences(findings: PassageFindings) -> list[str]:
    widening, count = findings.widening, len(findings.passages)
    if widening.found is None:
        known = "proved not to be" if widening.is_refuted else "not found"
        back = f"Moving every wall back by up to {widening.most:.3f} m was {known} enough."
        return [back, *_open_floor_sentences(findings.open_floor)]
    if not count:
        refuted = f"; by {widening.refuted:.3f} m was proved too little" if widening.refuted else ""
        return [f"Moving every wall back by {widening.found:.3f} m was found enough{refuted}."]
    sentences = [
        f"Passage {number} blocks: {_where(passage)}. {_missing(passage)}."
        for number, passage in enumerate(findings.passages, start=1)
    ]
    known = "found" if findings.are_enough else "not found"
    these = "this passage" if count == 1 else f"these {count} passages"
    return [*sentences, f"Widening only {these} was {known} enough."]


def _open_floor_sentences(floor: OpenFloor | None) -> list[str]:
    if floor is None:
        return []
    if floor.answer is Answer.FOUND:
        return ["Without any walls there is a path: the walls must move back by more than was tried."]
    proved = floor.answer is Answer.INFEASIBLE
    known = "It is proved that there is no path" if proved else "No path was found"
    return [f"{known} even without walls: the bodies may be in each other's way."] + [
        f"A path exists if {first} and {second} are allowed to overlap." for first, second in floor.pairs
    ]


def _where(passage: BlockingPassage) -> str:
    gap = passage.stretch.gap
    if gap is None:
        return f"at {_point(passage.stretch.contacts[0].wall)}"
    return f"{gap.width:.3f} m wide between {_point(gap.first)} and {_point(gap.second)}"


def _missing(passage: BlockingPassage) -> str:
    enough = f"{2.0 * passage.enough:.3f} m more width was found enough"
    if passage.refuted:
        return f"{enough}, {2.0 * passage.refuted:.3f} m more was proved too little"
    if passage.refuted is None:
        return f"{enough}; no amount was proved too little"
    return f"{enough}; its present width is proved too narrow"


def _goal_sentences(goal: BlockedPose) -> list[str]:
    sentences = [
        f"At the goal {contact.body} is {contact.depth:.3f} m behind the wall at {_point(contact.wall)}."
        for contact in goal.contacts
    ]
    sentences += [
        f"At the goal {overlap.bodies[0]} and {overlap.bodies[1]} overlap by {overlap.depth:.3f} m."
        for overlap in goal.overlaps
    ]
    if goal.widening.found is not None:
        sentences.append(f"With every wall moved back by {goal.widening.found:.3f} m the goal is free.")
    return sentences


def rows_of(diagnosis: Diagnosis) -> list[Row]:
    """Label and value of every row of the table of findings, which the command `why` shows."""
    rows = [("answer", diagnosis.answer.value)]
    findings = diagnosis.passages
    for number, passage in enumerate(findings.passages if findings is not None else (), start=1):
        proved = "unknown" if passage.refuted is None else f"{2.0 * passage.refuted:.3f}"
        missing = f"more than {proved} m, at most {2.0 * passage.enough:.3f} m"
        rows += [(f"passage {number}", _where(passage)), ("  missing width", missing)]
        rows += [("  in collision", _body(body)) for body in passage.stretch.bodies]
        if passage.stretch.limits:
            rows.append(("  joints at a limit", ", ".join(passage.stretch.limits)))
    return rows + [(relaxation.change.name, _relaxation(relaxation)) for relaxation in diagnosis.relaxations]


def _body(body: BodyAtFault) -> str:
    angles = ", ".join(
        f"{name} {degrees(low):.0f}° to {degrees(high):.0f}°"
        if name == "theta"
        else f"{name} {low:.2f} to {high:.2f}"
        for name, (low, high) in zip(body.axes, body.intervals, strict=True)
    )
    return f"{body.name}, {body.depth:.3f} m deep, at {angles}"


def _relaxation(relaxation: Relaxation) -> str:
    bracket, by = relaxation.bracket, relaxation.change.unit == "share"

    def amount(value: float) -> str:
        return f"{100.0 * value:.0f} % smaller" if by else f"{value:.2f} rad more at either limit"

    if bracket.found is not None:
        too_little = f" ({amount(bracket.refuted)} is proved too little)" if bracket.refuted else ""
        return f"{amount(bracket.found)} is enough{too_little}"
    known = "proved" if relaxation.never_enough else "no path found"
    return f"not enough by itself ({known} even at {amount(bracket.most)})"


def facts_of(diagnosis: Diagnosis) -> dict[str, Any]:
    """The findings as numbers, texts, lists and dictionaries, by the names that machines read."""
    facts: dict[str, Any] = {
        "answer": diagnosis.answer.value,
        "reason": diagnosis.reason,
        "slices": diagnosis.slices,
        "sentences": sentences_of(diagnosis),
    }
    findings, goal = diagnosis.passages, diagnosis.goal
    if findings is not None:
        facts["walls_moved_back_m"] = _bracket_facts(findings.widening)
        facts["way_sticks_out_m"] = findings.needed
        facts["widening_passages_is_enough"] = findings.are_enough
        if findings.open_floor is not None:
            pairs = [list(pair) for pair in findings.open_floor.pairs]
            answer = findings.open_floor.answer.value
            facts["without_walls"] = {"answer": answer, "pairs_in_the_way": pairs}
        facts["passages"] = [_passage_facts(passage) for passage in findings.passages]
    if goal is not None:
        facts["goal"] = {
            "configuration": goal.configuration.tolist(),
            "contacts": [
                {"body": c.body, "sticks_out_m": c.depth, "wall": c.wall.tolist()} for c in goal.contacts
            ],
            "overlaps": [{"bodies": list(o.bodies), "depth_m": o.depth} for o in goal.overlaps],
            "walls_moved_back_m": _bracket_facts(goal.widening),
        }
    if diagnosis.mixed:
        facts["mixed"] = [mixed_facts(cell) for cell in diagnosis.mixed]
    facts["relaxations"] = [
        {
            "name": relaxation.change.name,
            "unit": relaxation.change.unit,
            **_bracket_facts(relaxation.bracket),
            "proved_never_enough": relaxation.never_enough,
        }
        for relaxation in diagnosis.relaxations
    ]
    return facts


def _bracket_facts(bracket: Bracket) -> dict[str, Any]:
    return {
        "proved_too_little": bracket.refuted,
        "found_enough": bracket.found,
        "largest_tried": bracket.most,
        "proved_never_enough": bracket.is_refuted,
    }


def _passage_facts(passage: BlockingPassage) -> dict[str, Any]:
    stretch, gap = passage.stretch, passage.stretch.gap
    return {
        "walls": None if gap is None else [gap.first.tolist(), gap.second.tolist()],
        "width_m": None if gap is None else gap.width,
        "missing_m_proved_above": None if passage.refuted is None else 2.0 * passage.refuted,
        "missing_m_found_enough": 2.0 * passage.enough,
        "configuration": stretch.configuration.tolist(),
        "joints_at_limit": list(stretch.limits),
        "bodies": [
            {
                "name": body.name,
                "sticks_out_m": body.depth,
                "intervals": {n: list(i) for n, i in zip(body.axes, body.intervals, strict=True)},
            }
            for body in stretch.bodies
        ],
    }


def _point(values: FloatArray) -> str:
    return f"({values[0]:.3f}, {values[1]:.3f})"
