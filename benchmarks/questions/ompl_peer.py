"""OMPL's RRT-Connect with our compiled footprint check: the planner that a user would take instead.

The state space is R^2 x SO(2) x R^n, one subspace per joint, every axis measured in metres by which it moves
the team, so that distances are those of our sampler and motions are checked as densely. The range is set:
with OMPL's own choice, a fifth of the space, it finds far fewer paths in corridors. The check is compiled,
but OMPL calls it through Python: reading a state and crossing over to
the compiled code cost more than the check itself. That is why the rows state the number of checks and their
share of the time, and why a compiled RRT-Connect stands beside OMPL, which a pure C++ program would come
near to.

CPU time is that of ``solve`` alone: no set-up, no compiling, no smoothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib.util import find_spec
from time import process_time
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.questions.footprint import free_goals, prepared_check
from benchmarks.questions.peer import GOALS, MOTION_STEP, RANGE, PeerRun
from coop_drake.answers import PlanningProblem
from coop_drake.tree.levers import configuration_scale
from coop_drake.tree.pose import FloatArray

if TYPE_CHECKING:
    from ompl import base as ob

__all__ = ["has_ompl", "run_ompl"]

_TIMED_CALLS = 2_000


def has_ompl() -> bool:
    """Whether OMPL's Python bindings are installed."""
    return find_spec("ompl") is not None


def run_ompl(
    problem: PlanningProblem,
    seeds: Sequence[int],
    budget: float,
    check: Callable[..., bool] | None = None,
) -> tuple[PeerRun, ...]:
    """Run RRT-Connect once for every seed.

    Args:
        problem: The question.
        seeds: Positive seeds.
        budget: CPU time of each run [s].
        check: A check of x, y, theta, q... that is quicker to call than the usual one.
    """
    from ompl import util

    util.setLogLevel(util.LogLevel.LOG_NONE)
    check = check or prepared_check(problem)
    _attempt(problem, check, seeds[0], 0.05)
    return tuple(_attempt(problem, check, seed, budget) for seed in seeds)


def _attempt(problem: PlanningProblem, check: Callable[..., bool], seed: int, budget: float) -> PeerRun:
    from ompl import base as ob
    from ompl import geometric as og
    from ompl import util

    util.RNG.setSeed(seed)
    scale = configuration_scale(problem.tree)
    space = _space(problem, scale)
    information = ob.SpaceInformation(space)
    counted = _Counted(check, scale)
    information.setStateValidityChecker(counted)
    information.setup()
    question = ob.ProblemDefinition(information)
    question.addStartState(_state(space, problem.start, scale))
    goals = ob.GoalStates(information)
    for goal in free_goals(problem, check, GOALS, seed):
        goals.addState(_state(space, goal, scale))
    question.setGoal(goals)
    planner = og.RRTConnect(information)
    planner.setRange(RANGE)
    planner.setProblemDefinition(question)
    planner.setup()
    counted.calls = 0
    start = process_time()
    end = start + budget
    planner.solve(ob.PlannerTerminationCondition(lambda: process_time() > end))
    seconds = process_time() - start
    states = question.getSolutionPath().getStates() if question.hasExactSolution() else []
    path = _unwrapped(np.array([counted.values(state) for state in states]).reshape(-1, len(scale)))
    calls = counted.calls
    return PeerRun(seed, seconds, path, calls, calls * counted.seconds_per_call(information))


class _Counted:
    """The validity callback.

    Args:
        check: The compiled check of x, y, theta, q...
        scale: Metres per unit of every axis, in which the state space measures joints.
    """

    def __init__(self, check: Callable[..., bool], scale: FloatArray) -> None:
        self._check = check
        self._units = [1.0 / float(value) for value in scale[3:]]
        self.calls = 0

    def __call__(self, state: Any) -> bool:
        self.calls += 1
        return self._check(*self.values(state))

    def values(self, state: Any) -> tuple[float, ...]:
        """A state as x, y, theta, q..."""
        place = state[0]
        return (
            place[0],
            place[1],
            state[1].value,
            *[state[2 + k][0] * unit for k, unit in enumerate(self._units)],
        )

    def seconds_per_call(self, information: ob.SpaceInformation) -> float:
        """CPU time of one call through OMPL, measured on random states of the space."""
        sampler = information.allocStateSampler()
        states = [information.allocState() for _ in range(_TIMED_CALLS)]
        for state in states:
            sampler.sampleUniform(state)
        start = process_time()
        for state in states:
            information.isValid(state)
        return (process_time() - start) / len(states)


def _space(problem: PlanningProblem, scale: FloatArray) -> ob.CompoundStateSpace:
    """R^2 x SO(2) x R x ... in metres, bounded by the floor and the joints' limits."""
    from ompl import base as ob

    x_lower, y_lower, x_upper, y_upper = problem.workspace.bounds
    places = _interval_space([x_lower, y_lower], [x_upper, y_upper])
    angles = ob.SO2StateSpace()
    joints = [
        _interval_space([lower * unit], [upper * unit])
        for lower, upper, unit in zip(
            problem.tree.range_lower, problem.tree.range_upper, scale[3:], strict=True
        )
    ]
    whole = ob.CompoundStateSpace()
    weights = [1.0, float(scale[2]), *[1.0] * len(joints)]
    for part, weight in zip([places, angles, *joints], weights, strict=True):
        part.setLongestValidSegmentFraction(min(1.0, MOTION_STEP / (weight * part.getMaximumExtent())))
        whole.addSubspace(part, weight)
    whole.lock()
    return whole


def _interval_space(lower: list[float], upper: list[float]) -> ob.RealVectorStateSpace:
    from ompl import base as ob

    space, bounds = ob.RealVectorStateSpace(len(lower)), ob.RealVectorBounds(len(lower))
    for axis, (least, most) in enumerate(zip(lower, upper, strict=True)):
        bounds.setLow(axis, float(least))
        bounds.setHigh(axis, float(most))
    space.setBounds(bounds)
    return space


def _state(space: ob.CompoundStateSpace, z: FloatArray, scale: FloatArray) -> ob.CompoundState:
    state = space.allocState()
    state[0][0], state[0][1] = float(z[0]), float(z[1])
    state[1].value = float(z[2])
    for k, value in enumerate(z[3:] * scale[3:]):
        state[2 + k][0] = float(value)
    space.enforceBounds(state)
    return state


def _unwrapped(path: FloatArray) -> FloatArray:
    """The path with circular axes unwrapped, so that neighbours differ by pi at most."""
    path[:, 2] = np.unwrap(path[:, 2])
    return path
