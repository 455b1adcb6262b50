"""Why figures may differ: errata of the paper that matter here, and what the reconstruction had to assume."""

from __future__ import annotations

__all__ = ["ASSUMPTIONS", "ERRATA", "explanation"]

ERRATA = {
    "E4": "(4) is printed with the workspace where its complement is meant: a team is free inside the floor.",
    "E6": "(6) overlines union and intersection alike; the intersection is the under-approximation.",
    "E9": "With (6) as printed, positions where some angle hits a wall would be called safe.",
    "E10": "Cells switch when the object is in the next cell and its energy there fits the next cell's room, "
    "not as soon as it is in.",
    "E15a": "(15) prints K d for the energy a wall can take; a spring holds K d²/2.",
    "E15b": "(15) measures the distance to a boundary that includes the goal's, which keeps the object out "
    "of its goal; the distance to the safe set's boundary is used.",
    "E17a": "(17) starts both walls of the funnel at the lower bound, which leaves no room; the upper wall "
    "starts at the upper bound.",
    "E17b": "An axis that is handed over on the rim of its next slice gets an infinite push (ln 0); a tenth "
    "of the goal interval at each end does not count as arrived.",
    "E18": "(18) and (38) have no gain before the logarithm and end in a point; a gain κ is added and the "
    "last goal is an interval.",
    "E20": "(20) lacks a dot: without the wall's rate the angle does not follow its funnel.",
    "E21": "(21) and (31) share the torque with the wrong sign, which opposite grasps hide.",
    "E23": "The projector in (23), (24), (34) must be weighted by the robot's inertia.",
    "E35": "(35)–(38) damp joint 2 by the rate of joint 1 and lack gains; every joint gets the law of the "
    "angle.",
    "E39": "In (39) and Table 1 the overbar marks the lower end, elsewhere the upper one.",
    "ET1": "Two numbers of Table 1 have a wrong sign: row 3 prints 0.367 for −0.367, row 24 −0.050 for "
    "0.050.",
}
"""Errata by their ids in docs/errata.md."""

ASSUMPTIONS = {
    "R1": "The floor is drawn anew: Figure 4 gives no coordinates. Two rooms, a corridor with a bend, a hall "
    "and a doorway stand for the paper's narrow and wide places.",
    "R2": "Lengths of the bodies are ours: the paper says that the object is a rectangle and each arm has a "
    "joint.",
    "R3": "Masses of the robots are ours: Table 2 gives the object's alone.",
    "R4": "The joints are free at the goal: the paper asks for a pose of the object only.",
    "R5": "Arrival means within the scenario's tolerances; the paper gives none.",
    "R6": "Table 2 has no gains for the joints' law but λ_q, and no κ: all of them are 1 here.",
    "R7": "Robots call themselves ready when the energy in the next funnel is low enough, which the paper "
    "leaves open.",
    "R8": "Whole turns of the goal's angle do not count: the planner may turn the object either way.",
    "R9": "The planner takes the quickest of the ways it finds and lays its cells anew along it; the paper's "
    "searches its cells once.",
    "R10": "The paper prints no polygons of its 30 cells: here each is a square, a step further along an "
    "empty hall.",
}


def explanation(key: str) -> str:
    """Return the sentence that explains the id of an erratum or an assumption."""
    return ERRATA[key] if key in ERRATA else ASSUMPTIONS[key]
