"""A diagnosis in words and in numbers."""

from __future__ import annotations

from math import degrees
from typing import Any

from coop_drake.diagnosis.blocking import Passage
from coop_drake.diagnosis.bodies import WithoutWalls
from coop_drake.diagnosis.bracket import Bracket
from coop_drake.diagnosis.diagnosis import BlockedPose, Diagnosis, PassageFindings
from coop_drake.diagnosis.mixed import mixed_facts, mixed_sentences
from coop_drake.diagnosis.passages import BodyAtFault
from coop_drake.diagnosis.relaxations import Relaxation
from coop_drake.diagnosis.trials import Answer
from coop_drake.tree.pose import FloatArray

__all__ = ["facts_of", "rows_of", "sentences_of"]

Row = tuple[str, str]


def sentences_of(diagnosis: Diagnosis) -> list[str]:
    """What was found, in sentences; proved and merely found things are told apart."""
    if diagnosis.answer is Answer.FOUND:
        return [f"Feasible: a channel was found that keeps {diagnosis.margin:.3f} m from the walls."]
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
    growth = findings.growth
    if growth.found is None:
        known = "proved not to be" if growth.is_refuted else "not found"
        back = f"Moving every wall back by up to {growth.most:.3f} m was {known} enough."
        return [back, *_bare_sentences(findings.bare)]
    back = f"Moving every wall back by {growth.found:.3f} m was found enough"
    back += f", by {growth.refuted:.3f} m proved too little." if growth.refuted else "."
    if not findings.passages:
        return [back]
    count = len(findings.passages)
    many = "One passage blocks" if count == 1 else f"{count} passages block"
    alone = "widening it alone" if count == 1 else "widening these alone"
    enough = f"{alone} was found enough" if findings.are_enough else f"{alone} was not found enough"
    sentences = [back, f"{many}; {enough}."]
    for number, passage in enumerate(findings.passages, start=1):
        sentences.append(f"Passage {number}: {_where(passage)}, {_missing(passage)}.")
    return sentences


def _bare_sentences(bare: WithoutWalls | None) -> list[str]:
    if bare is None:
        return []
    if bare.answer is Answer.FOUND:
        return ["Without any walls there is a way: the walls block by more than was tried."]
    known = "exists, proved" if bare.answer is Answer.INFEASIBLE else "was found"
    sentences = [f"Even without walls no way {known}: the bodies may be in each other's way."]
    sentences += [
        f"If {first} and {second} could overlap, there would be one." for first, second in bare.pairs
    ]
    return sentences


def _where(passage: Passage) -> str:
    gap = passage.stretch.gap
    if gap is None:
        return f"at {_point(passage.stretch.contacts[0].wall)}"
    return f"{gap.width:.3f} m wide between {_point(gap.first)} and {_point(gap.second)}"


def _missing(passage: Passage) -> str:
    enough = f"{2.0 * passage.enough:.3f} m more was found enough"
    if passage.refuted:
        return f"{enough}, {2.0 * passage.refuted:.3f} m more was proved too little"
    if passage.refuted is None:
        return f"{enough}; no amount was proved too little"
    return f"{enough}; as it is it was proved too narrow"


def _goal_sentences(goal: BlockedPose) -> list[str]:
    sentences = [
        f"At the goal {contact.body} sticks out of the floor by {contact.depth:.3f} m "
        f"at the wall point {_point(contact.wall)}."
        for contact in goal.contacts
    ]
    sentences += [
        f"At the goal {overlap.bodies[0]} and {overlap.bodies[1]} overlap by {overlap.depth:.3f} m."
        for overlap in goal.overlaps
    ]
    if goal.retreat.found is not None:
        sentences.append(f"With every wall moved back by {goal.retreat.found:.3f} m the goal is free.")
    return sentences


def rows_of(diagnosis: Diagnosis) -> list[Row]:
    """Label and value of every row of the closing table."""
    rows = [("answer", diagnosis.answer.value)]
    if diagnosis.margin is not None:
        rows.append(("margin kept", f"{diagnosis.margin:.3f} m"))
    findings = diagnosis.passages
    for number, passage in enumerate(findings.passages if findings is not None else (), start=1):
        rows += [(f"passage {number}", _where(passage)), ("  missing width", _range(passage))]
        rows += [("  sticks out", _body(body)) for body in passage.stretch.bodies]
        if passage.stretch.limits:
            rows.append(("  joints at a limit", ", ".join(passage.stretch.limits)))
        rows.append(("wider passage", f"by {2.0 * passage.enough:.3f} m round {_centre(passage)}"))
    rows += [(relaxation.change.name, _relaxation(relaxation)) for relaxation in diagnosis.relaxations]
    return rows


def _range(passage: Passage) -> str:
    lower = "unknown" if passage.refuted is None else f"{2.0 * passage.refuted:.3f}"
    return f"more than {lower} m, at most {2.0 * passage.enough:.3f} m"


def _centre(passage: Passage) -> str:
    gap = passage.stretch.gap
    return _point(passage.stretch.contacts[0].wall if gap is None else 0.5 * (gap.first + gap.second))


def _body(body: BodyAtFault) -> str:
    angles = ", ".join(
        f"{name} {degrees(low):.0f}° to {degrees(high):.0f}°"
        if name == "theta"
        else f"{name} {low:.2f} to {high:.2f}"
        for name, (low, high) in zip(body.axes, body.intervals, strict=True)
    )
    return f"{body.name} by {body.depth:.3f} m at {angles}"


def _relaxation(relaxation: Relaxation) -> str:
    bracket = relaxation.bracket
    if bracket.found is not None:
        too_little = (
            "" if not bracket.refuted else f" ({_amount(relaxation, bracket.refuted)} proved too little)"
        )
        return f"enough by {_amount(relaxation, bracket.found)}{too_little}"
    known = "proved" if relaxation.never_enough else "not found"
    return f"not by this alone ({known} up to {_amount(relaxation, bracket.most)})"


def _amount(relaxation: Relaxation, amount: float) -> str:
    if relaxation.change.unit == "share":
        return f"{100.0 * amount:.0f} % of their size"
    return f"{amount:.2f} rad at either limit"


def facts_of(diagnosis: Diagnosis) -> dict[str, Any]:
    """The same as plain numbers, texts, lists and dictionaries, by the names that machines read."""
    facts: dict[str, Any] = {
        "answer": diagnosis.answer.value,
        "reason": diagnosis.reason,
        "slices": diagnosis.slices,
        "margin_m": diagnosis.margin,
        "sentences": sentences_of(diagnosis),
    }
    findings = diagnosis.passages
    if findings is not None:
        facts["walls_moved_back_m"] = _bracket_facts(findings.growth)
        facts["way_sticks_out_m"] = findings.needed
        facts["widening_passages_is_enough"] = findings.are_enough
        if findings.bare is not None:
            pairs = [list(pair) for pair in findings.bare.pairs]
            facts["without_walls"] = {"answer": findings.bare.answer.value, "pairs_in_the_way": pairs}
        facts["passages"] = [_passage_facts(passage) for passage in findings.passages]
    if diagnosis.goal is not None:
        facts["goal"] = _goal_facts(diagnosis.goal)
    if diagnosis.mixed:
        facts["mixed"] = [mixed_facts(cell) for cell in diagnosis.mixed]
    facts["relaxations"] = [
        {
            "name": r.change.name,
            "unit": r.change.unit,
            **_bracket_facts(r.bracket),
            "proved_never_enough": r.never_enough,
        }
        for r in diagnosis.relaxations
    ]
    return facts


def _bracket_facts(bracket: Bracket) -> dict[str, Any]:
    return {
        "proved_too_little": bracket.refuted,
        "found_enough": bracket.found,
        "largest_tried": bracket.most,
        "proved_never_enough": bracket.is_refuted,
    }


def _passage_facts(passage: Passage) -> dict[str, Any]:
    stretch, gap = passage.stretch, passage.stretch.gap
    return {
        "walls": None if gap is None else [_list(gap.first), _list(gap.second)],
        "width_m": None if gap is None else gap.width,
        "missing_m_proved_above": None if passage.refuted is None else 2.0 * passage.refuted,
        "missing_m_found_enough": 2.0 * passage.enough,
        "configuration": _list(stretch.configuration),
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


def _goal_facts(goal: BlockedPose) -> dict[str, Any]:
    return {
        "configuration": _list(goal.configuration),
        "contacts": [{"body": c.body, "sticks_out_m": c.depth, "wall": _list(c.wall)} for c in goal.contacts],
        "overlaps": [{"bodies": list(o.bodies), "depth_m": o.depth} for o in goal.overlaps],
        "walls_moved_back_m": _bracket_facts(goal.retreat),
    }


def _list(values: FloatArray) -> list[float]:
    return [float(value) for value in values]


def _point(values: FloatArray) -> str:
    return f"({values[0]:.3f}, {values[1]:.3f})"
