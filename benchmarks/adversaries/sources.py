"""The questions whose answers are altered, by the kind of answer that they have."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from benchmarks.adversaries.questions import (
    bend_question,
    crossing_question,
    discs_in_a_corridor,
    random_question,
)
from benchmarks.planner.family import corridor_problem
from coop_drake.answers import PlanningProblem

Ask = Callable[[], PlanningProblem | None]

PLANS: dict[str, Ask] = {
    "base": corridor_problem,
    "tight": partial(corridor_problem, 0.9),
    "three": partial(corridor_problem, 1.3, 1.5, 3),
    "elbow": partial(corridor_problem, joints_per_arm=2),
    **{f"random {seed}": partial(random_question, seed) for seed in (0, 3, 9, 13, 16, 85, 86, 87)},
}
SLICES: dict[str, Ask] = {
    "closed": partial(corridor_problem, 0.77),
    "elbow_closed": partial(corridor_problem, 0.6, joints_per_arm=2),
    **{f"bend {seed}": partial(bend_question, seed, "object") for seed in range(8)},
}
JOINTS: dict[str, Ask] = {
    "squeezed": partial(discs_in_a_corridor, 1.1),
    "three_closed": partial(corridor_problem, 0.95, 1.5, 3),
    **{f"hinge {seed}": partial(bend_question, seed, "revolute") for seed in (0, 2, 3, 5)},
    **{f"slide {seed}": partial(bend_question, seed, "prismatic") for seed in (0, 1, 3, 4, 5)},
}
NARROW: dict[str, Ask] = {
    "narrow": partial(corridor_problem, 0.45),
    "three_narrow": partial(corridor_problem, 0.45, 1.5, 3),
    **{f"random {seed}": partial(random_question, seed) for seed in (5, 6, 12, 17, 25, 63, 92, 98)},
}
BLOCKED: dict[str, Ask] = {
    **{f"crossing {seed}": partial(crossing_question, seed, crossed="goal") for seed in range(4)},
    **{f"hinge {seed}": partial(bend_question, seed, "revolute", in_corridor=True) for seed in (0, 4)},
    **{f"random {seed}": partial(random_question, seed) for seed in (7, 21, 41, 54, 57, 97)},
}

ROUNDS = {
    "base": 2, "tight": 2, "three": 2, "elbow": 2, "closed": 2, "elbow_closed": 3, "three_closed": 1,
    "hinge 0": 2, "hinge 4": 2, "random 41": 1,
}  # fmt: skip
"""How many times each kind of alteration is applied to answers that take long to check."""

SOURCES: dict[str, tuple[Ask, int]] = {
    f"{kind}/{name}": (ask, ROUNDS.get(name, 7 if kind == "plan" else 6))
    for kind, asks in (
        ("plan", PLANS),
        ("slices", SLICES),
        ("slices_with_joints", JOINTS),
        ("narrow", NARROW),
        ("blocked_goal", BLOCKED),
    )
    for name, ask in asks.items()
}
"""By kind and name: the question, and how many times each kind of alteration is applied to its answer."""
