"""A diagnosis in rows, sentences and a picture."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patches import Circle
from shapely import Point

from coop_drake.answers import PlanningProblem
from coop_drake.answers.plan import MixedCell
from coop_drake.diagnosis.contacts import BodyAtFault
from coop_drake.diagnosis.diagnosing import BlockedPose, Diagnosis, PassageFindings, Relaxation
from coop_drake.diagnosis.variants import Answer, BlockingPassage, Bracket, OpenFloor
from coop_drake.drawing import draw_polygon, draw_workspace, new_figure, team_footprints
from coop_drake.drawing.colours import AT_FAULT, BLUE, GREY, INK, NOT_AT_FAULT, OUTSIDE, PAPER, WALL
from coop_drake.geometry.polygons import parts_of
from coop_drake.tree.arrays import FloatArray

# A diagnosis in rows and sentences.

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


# The picture of a diagnosis: the floor, the walls on both sides of a passage, the team where it collides.

MOST_PLACES = 3
"""Places that are shown enlarged at most: more would be too small to read [-]."""

BORDER = 0.35
"""Border around the team in an enlarged place [m]."""

SIDE = 4.8
"""Height of every panel [in]."""


def diagnosis_figure(problem: PlanningProblem, diagnosis: Diagnosis) -> Figure | None:
    """Draw the whole floor and, enlarged beside it, every place that blocks; None if nothing does."""
    places = _places(diagnosis)
    if not places:
        return None
    places = places[:MOST_PLACES]
    x_min, y_min, x_max, y_max = problem.workspace.bounds
    wide = min(2.0, max(0.5, (x_max - x_min + 0.6) / (y_max - y_min + 0.6)))
    caption = "Orange bodies collide at the goal; dark red is what lies behind a wall."
    if diagnosis.passages is not None:
        caption = (
            "Orange bodies collide with a wall in the passage; dark red is what lies behind the wall here. "
            "The blue line is the object's path with the walls moved back."
        )
    figure = new_figure(SIDE * (wide + len(places)) + 1.0, SIDE + 0.9, caption)
    engine = figure.get_layout_engine()
    if isinstance(engine, ConstrainedLayoutEngine):
        engine.set(rect=(0.01, 0.09, 0.98, 0.88))
    axes = figure.subplots(1, 1 + len(places), squeeze=False, width_ratios=[wide, *[1.0] * len(places)])[0]
    _overview(axes[0], problem, diagnosis, [configuration for configuration, _, _ in places])
    for number, (ax, (configuration, bodies, passage)) in enumerate(
        zip(axes[1:], places, strict=True), start=1
    ):
        _enlarged(ax, problem, configuration, bodies)
        title = f"{number}: " if len(places) > 1 else ""
        if passage is not None:
            title += _mark_gap(ax, passage)
        else:
            title += _goal_title(diagnosis)
        ax.set_title(title, color=OUTSIDE, fontweight="bold")
    return figure


def _goal_title(diagnosis: Diagnosis) -> str:
    goal = diagnosis.goal
    depths = [] if goal is None else [c.depth for c in goal.contacts] + [o.depth for o in goal.overlaps]
    return "the goal is blocked" + (f", by {max(depths):.3f} m" if depths else "")


def _places(diagnosis: Diagnosis) -> list[tuple[FloatArray, frozenset[str], BlockingPassage | None]]:
    """Configurations to show, with the bodies at fault."""
    if diagnosis.goal is not None:
        goal = diagnosis.goal
        names = {contact.body for contact in goal.contacts}
        names.update(name for overlap in goal.overlaps for name in overlap.bodies)
        return [(goal.configuration, frozenset(names), None)]
    if diagnosis.passages is None:
        return []
    return [
        (p.stretch.configuration, frozenset(body.name for body in p.stretch.bodies), p)
        for p in diagnosis.passages.passages
    ]


def _overview(ax: Axes, problem: PlanningProblem, diagnosis: Diagnosis, places: list[FloatArray]) -> None:
    draw_workspace(ax, problem.workspace)
    if diagnosis.passages is not None and diagnosis.passages.path is not None:
        path = diagnosis.passages.path
        ax.plot(path[:, 0], path[:, 1], color=BLUE, linewidth=1.6, zorder=4)
    for label, pose in (("start", problem.start), ("goal", problem.goal_pose)):
        ax.plot(pose[0], pose[1], "o", color=INK, markersize=5, zorder=6)
        ax.annotate(label, _xy(pose), xytext=(6, 5), textcoords="offset points", zorder=6, fontweight="bold")
    for number, z in enumerate(places, start=1):
        for footprint in team_footprints(problem.tree, z):
            draw_polygon(ax, footprint.shape, facecolor=NOT_AT_FAULT, edgecolor="none", zorder=3)
        ring = Circle(_xy(z), problem.tree.reach, fill=False, edgecolor=OUTSIDE, linewidth=1.6, zorder=6)
        ax.add_patch(ring)
        if len(places) > 1:
            ax.annotate(
                str(number), _xy(z), ha="center", va="center", zorder=7, color=OUTSIDE, fontweight="bold"
            )


def _enlarged(ax: Axes, problem: PlanningProblem, z: FloatArray, bodies: frozenset[str]) -> None:
    draw_workspace(ax, problem.workspace)
    ax.set_facecolor(WALL)
    for footprint in team_footprints(problem.tree, z):
        faulty = footprint.name in bodies
        fill, edge = (AT_FAULT, AT_FAULT) if faulty else (NOT_AT_FAULT, GREY)
        draw_polygon(ax, footprint.shape, facecolor=fill, edgecolor="none", alpha=0.65, zorder=3)
        draw_polygon(ax, footprint.shape, facecolor="none", edgecolor=edge, linewidth=1.0, zorder=4)
        outside = footprint.shape.difference(problem.workspace)
        for part in parts_of(outside):
            draw_polygon(ax, part, facecolor=OUTSIDE, edgecolor=OUTSIDE, linewidth=1.5, zorder=5)
    reach = max(_reach(problem, z), 0.5) + BORDER
    ax.set_xlim(z[0] - reach, z[0] + reach)
    ax.set_ylim(z[1] - reach, z[1] + reach)


def _reach(problem: PlanningProblem, z: FloatArray) -> float:
    """How far the team reaches from the object's origin at a configuration [m]."""
    centre = Point(z[:2])
    return max(centre.hausdorff_distance(footprint.shape) for footprint in team_footprints(problem.tree, z))


def _mark_gap(ax: Axes, passage: BlockingPassage) -> str:
    """Draw the two wall points, the width between them and what is missing; returns the title."""
    gap = passage.stretch.gap
    missing = f"{2.0 * passage.enough:.3f} m more is enough"
    if gap is None:
        return missing
    ax.annotate(
        "",
        _xy(gap.second),
        xytext=_xy(gap.first),
        arrowprops={"arrowstyle": "<->", "color": INK, "linewidth": 2.0, "shrinkA": 0, "shrinkB": 0},
        zorder=7,
    )
    ax.plot(*np.array([gap.first, gap.second]).T, "o", color=OUTSIDE, markersize=7, zorder=8)
    ax.annotate(
        f"{gap.width:.3f} m\n+ {2.0 * passage.enough:.3f} m",
        _xy(0.5 * (gap.first + gap.second)),
        ha="center",
        va="center",
        zorder=9,
        fontweight="bold",
        bbox={"boxstyle": "round,pad=0.25", "facecolor": PAPER, "edgecolor": INK, "linewidth": 0.8},
    )
    return f"{gap.width:.3f} m wide, {missing}"


def _xy(point: FloatArray) -> tuple[float, float]:
    return float(point[0]), float(point[1])
