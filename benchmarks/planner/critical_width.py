"""The critical width of corridors, by bisection with the planner's own answers: below no way, above a way.

Every "no" rests on a proof and every "yes" on certified cells, so that the interval between them is certain.
An undecided answer moves neither bound.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, isfinite

from benchmarks.isolated import in_own_process
from benchmarks.planner.family import corridor_problem
from benchmarks.planner.ours import plan_once_warm
from benchmarks.rows import Row
from benchmarks.tasks import Rows, Task
from coop_drake.answers import PlanningProblem

ANSWER, START_UP = 60.0, 30.0
"""CPU time of one answer, and of what a process does before: imports and questions that load kernels [s]."""

WAYS, NO_WAYS = ("found", "beyond limits"), ("infeasible",)
"""Answers that lower the upper bound, and those that raise the lower one."""


@dataclass(frozen=True)
class Corridor:
    """Questions of one team by the width of their corridor.

    Attributes:
        ask: The question for a width [m].
        narrow: A width for which it is proved that there is no way [m].
        wide: A width for which there is one [m].
        within: The bounds are this near to each other or to a width that is undecided [m].
    """

    ask: Callable[[float], PlanningProblem]
    narrow: float
    wide: float
    within: float


CORRIDORS = {
    "two": Corridor(corridor_problem, 0.77, 0.79, 2e-4),
    "three": Corridor(lambda width: corridor_problem(width, 1.5, robots=3), 0.9955, 1.0005, 5e-3),
    "elbow": Corridor(lambda width: corridor_problem(width, joints_per_arm=2), 0.62, 0.7, 5e-3),
}
"""Teams of the family of questions, and between which widths the critical one lies."""


@dataclass(frozen=True)
class Interval:
    """What is known of a critical width.

    Attributes:
        no_way: The largest width for which no way was proved [m].
        way: The smallest width for which a way was certified [m].
        undecided: Widths asked for which neither was [m].
        seconds: CPU time of each answer, in the order asked [s].
    """

    no_way: float
    way: float
    undecided: tuple[float, ...]
    seconds: tuple[float, ...]


def critical_interval(corridor: Corridor, answer: Callable[[PlanningProblem], tuple[str, float]]) -> Interval:
    """Bisect a critical width.

    Args:
        corridor: The questions. Its bounds are asked first.
        answer: Answers a question; returns the answer and its CPU time [s].
    """
    no_way, way, undecided, seconds = -inf, inf, list[float](), list[float]()
    widths = [corridor.narrow, corridor.wide]
    while widths:
        width = widths.pop(0)
        said, took = answer(corridor.ask(width))
        seconds.append(took)
        if said in WAYS:
            way = min(way, width)
        elif said in NO_WAYS:
            no_way = max(no_way, width)
        else:
            undecided.append(width)
        if not widths and -inf < no_way and way < inf:
            between = sorted(width for width in undecided if no_way < width < way)
            gaps = [(no_way, min([*between, way])), (max([no_way, *between]), way)]
            low, high = max(gaps, key=lambda gap: gap[1] - gap[0])
            widths = [round(0.5 * (low + high), 6)] if high - low > corridor.within else []
    return Interval(no_way, way, tuple(sorted(undecided)), tuple(seconds))


def critical_width_tasks(limit: float = ANSWER) -> list[Task]:
    """One task for every team.

    Args:
        limit: CPU time of one answer [s].
    """

    def task(name: str, corridor: Corridor) -> Task:
        place = f"planner/critical_width/{name}"
        return Task(place, lambda rows: critical_width_rows(place, corridor, limit))

    return [task(name, corridor) for name, corridor in CORRIDORS.items()]


def critical_width_rows(name: str, corridor: Corridor, limit: float) -> Rows:
    """The interval of a critical width, and the time of the answers."""

    def answer(problem: PlanningProblem) -> tuple[str, float]:
        done = in_own_process(plan_once_warm, problem, limit=START_UP + limit)
        return ("none", limit) if done.value is None else (done.value.answer, done.value.cpu_seconds)

    found = critical_interval(corridor, answer)
    bounds = [f"{bound:.5f} m" if isfinite(bound) else "unknown" for bound in (found.no_way, found.way)]
    apart = found.way - found.no_way
    return [
        Row(f"{name}/answer", float(isfinite(apart)), " to ".join(bounds)),
        *([Row(f"{name}/apart_mm", 1e3 * apart, "mm")] if isfinite(apart) else []),
        Row(f"{name}/undecided", len(found.undecided), f"of {len(found.seconds)} widths"),
        Row(f"{name}/slowest_cpu_seconds", max(found.seconds), "s"),
        Row(f"{name}/cpu_seconds", sum(found.seconds), "s"),
    ]
