"""Other planners that search for a path: compiled random trees, then OMPL where it is installed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from itertools import pairwise
from math import nan, pi, remainder
from time import process_time
from typing import TYPE_CHECKING, Any

import numba
import numpy as np
import shapely

from benchmarks.questions.tree_kernels import rrt_connect
from coop_drake.answers import PlanningProblem
from coop_drake.planning.sampling.collision import grid_for_team, is_free
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import ConvexShape, configuration_scale, team_arrays

if TYPE_CHECKING:
    from ompl import base as ob


MOTION_STEP = 0.03
"""No axis moves the team further than this between two checks of a motion, as in our sampler [m]."""
RANGE = 1.2
"""Longest step of a tree, as in our sampler; OMPL's own choice, a fifth of the space, is far worse [m]."""
GOALS = 24
"""Goal configurations that a peer may end in, as many as our sampler takes."""


@dataclass(frozen=True)
class PeerRun:
    """One run of another planner.

    Attributes:
        seed: Its seed.
        cpu_seconds: CPU time until it found a path or gave up.
        path: Configurations from start to goal, theta unwrapped, shape (m, 3 + n); no rows if none was found.
        checks: Configurations that it had checked.
        check_seconds: CPU time that these checks took together, None where that is not measured.
    """

    seed: int
    cpu_seconds: float
    path: FloatArray
    checks: int
    check_seconds: float | None = None

    @property
    def found(self) -> bool:
        """Whether it claims a path."""
        return len(self.path) > 0


_TRIES_PER_GOAL = 40
"""Random values of the free joints that are tried for each goal configuration."""


def prepared_check(problem: PlanningProblem) -> Callable[..., bool]:
    """Prepare ``check(x, y, theta, q...)`` for one question: is this configuration free?

    The team and the floor are handed over once, which makes a call three times as quick.
    """
    team = problem.tree.arrays
    grid = grid_for_team(problem.workspace, team)
    check = partial(is_free, team, grid)
    return lambda *values: check(np.array(values), 0.0)


def free_goals(problem: PlanningProblem, check: Callable[..., bool], count: int, seed: int) -> FloatArray:
    """Free configurations at the goal, with random values of the free joints; shape (m <= count, 3 + n).

    Args:
        problem: The question.
        check: Its compiled check.
        count: How many are wanted.
        seed: Seed of the random joints.
    """
    random = np.random.default_rng(seed)
    lower, upper = problem.tree.range_lower, problem.tree.range_upper
    fixed = np.array([np.nan if value is None else value for value in problem.goal_joints], dtype=float)
    goals: list[FloatArray] = []
    for _ in range(_TRIES_PER_GOAL * count):
        joints = lower + random.random(len(fixed)) * (upper - lower)
        goal = np.concatenate((problem.goal_pose, np.where(np.isnan(fixed), joints, fixed)))
        if check(*map(float, goal)):
            goals.append(goal)
        if len(goals) == count or not np.isnan(fixed).any():
            break
    return np.array(goals).reshape(-1, 3 + len(fixed))


_DENSE = 0.002
"""Distance between the compiled checks [m]."""
_EXACT = 0.05
"""Distance between shapely's checks [m]."""
_ARRIVED = 1e-6
"""A path that ends this close to the goal has arrived [m, rad]: it absorbs rounding."""


def fault_of(problem: PlanningProblem, path: FloatArray) -> str:
    """Say what is wrong with a path; an empty string if it is valid.

    It must begin at the start and end at the goal, modulo whole turns, keep the joints' limits, and no
    configuration on the straight segments between its own may touch a wall or bring two bodies together.

    Args:
        problem: The question.
        path: Configurations, theta unwrapped, shape (m, 3 + n).
    """
    if not _same(problem, path[0], problem.start):
        return "it does not begin at the start"
    goal = [
        value if asked is None else asked
        for value, asked in zip(path[-1], (*problem.goal_pose, *problem.goal_joints), strict=True)
    ]
    if not _same(problem, path[-1], np.array(goal)):
        return "it does not end at the goal"
    joints, tree = path[:, 3:], problem.tree
    if (joints < tree.joint_lower - _ARRIVED).any() or (joints > tree.joint_upper + _ARRIVED).any():
        return "a joint leaves its range"
    team = tree.arrays
    grid = grid_for_team(problem.workspace, team)
    scale = configuration_scale(tree)
    for z in _densified(path, scale, _DENSE):
        if not is_free(team, grid, z, 0.0):
            return f"it collides at {np.round(z, 4).tolist()}"
    return _exact_fault(problem, _densified(path, scale, _EXACT))


def _same(problem: PlanningProblem, first: FloatArray, second: FloatArray) -> bool:
    turns = zip(first - second, (False, False, *problem.tree.circular), strict=True)
    away = [abs(remainder(off, 2.0 * pi)) if circular else abs(off) for off, circular in turns]
    return max(away) <= _ARRIVED


def _densified(path: FloatArray, scale: FloatArray, step: float) -> FloatArray:
    """Configurations along a path between which no point of the team moves further than a step."""
    parts = [path[:1]]
    for first, last in pairwise(path):
        count = max(1, int(np.ceil((np.abs(last - first) * scale).sum() / step)))
        parts.append(first + (last - first) * (np.arange(1, count + 1) / count)[:, None])
    return np.concatenate(parts)


def _exact_fault(problem: PlanningProblem, path: FloatArray) -> str:
    """Faults that shapely finds: pieces outside the floor, or pieces of two bodies that intersect."""
    tree, floor = problem.tree, problem.workspace
    shapely.prepare(floor)
    edge = floor.boundary
    poses = [np.array([[p.x, p.y, p.angle] for p in tree.poses(z)]) for z in path]
    placed = np.array(poses)
    pieces: dict[tuple[int, int], list[tuple[np.ndarray, float]]] = {}
    for c, component in enumerate(tree.components):
        for b, body in enumerate(component.bodies):
            pieces[c, b] = [(_moved(shape, placed[:, c]), shape.radius) for shape in body.shapes]
    for (c, b), shapes in pieces.items():
        for outline, radius in shapes:
            inside = shapely.covers(floor, outline)
            if radius > 0.0:
                inside &= shapely.distance(edge, outline) >= radius
            if not inside.all():
                return f"{tree.components[c].bodies[b].name} leaves the floor"
    for first, second in tree.collision_pairs:
        for outline, radius in pieces[first]:
            for other, growth in pieces[second]:
                if (shapely.distance(outline, other) <= radius + growth).any():
                    names = [tree.components[c].bodies[b].name for c, b in (first, second)]
                    return f"{names[0]} and {names[1]} meet"
    return ""


def _moved(shape: ConvexShape, poses: FloatArray) -> np.ndarray:
    """A piece without its growth at poses (x, y, angle), shape (m, 3): m points, segments or polygons."""
    cosine, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    turn = np.stack([np.stack([cosine, -sine], -1), np.stack([sine, cosine], -1)], -2)
    corners = np.einsum("mij,vj->mvi", turn, shape.vertices) + poses[:, None, :2]
    if corners.shape[1] == 1:
        return np.asarray(shapely.points(corners[:, 0]))
    return np.asarray(shapely.linestrings(corners) if corners.shape[1] == 2 else shapely.polygons(corners))


CHECKS = 300_000
"""Budget of one run, in configurations checked."""


def run_trees(problem: PlanningProblem, seeds: Sequence[int], checks: int = CHECKS) -> tuple[PeerRun, ...]:
    """Run the compiled trees once for every seed.

    Args:
        problem: The question.
        seeds: Seeds.
        checks: Configurations that each run may check.
    """
    tree = problem.tree
    team, scale, check = tree.arrays, configuration_scale(tree), prepared_check(problem)
    grid = grid_for_team(problem.workspace, team)
    x_lower, y_lower, x_upper, y_upper = problem.workspace.bounds
    lower = np.array([x_lower, y_lower, -np.pi, *tree.range_lower])
    upper = np.array([x_upper, y_upper, np.pi, *tree.range_upper])
    start = problem.start.astype(float)

    def attempt(seed: int, budget: int) -> PeerRun:
        goals = free_goals(problem, check, GOALS, seed)
        if len(goals) == 0:
            return PeerRun(seed, 0.0, goals, 0)
        random = np.random.default_rng(seed)
        begin = process_time()
        path, spent = rrt_connect(
            team, grid, start, goals, lower, upper, scale, RANGE, MOTION_STEP, random, budget
        )
        return PeerRun(seed, process_time() - begin, path, spent)

    attempt(seeds[0], 1)
    return tuple(attempt(seed, checks) for seed in seeds)


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


_CHECKS = 50_000
"""Configurations that one run of the trees may check, about 0.2 s: most paths are found at once, and trees
that went wrong are given up."""


@dataclass(frozen=True)
class Searched:
    """What other planners found.

    Attributes:
        planners: Those that searched, in this order; the last one found the path if there is one.
        path: A path that stands the dense check, shape (m, 3 + n); None if none was found.
        seconds: CPU time that they took together; NaN if none searched [s].
    """

    planners: tuple[str, ...] = ()
    path: FloatArray | None = None
    seconds: float = nan


def search_by_peers(problem: PlanningProblem, seconds: float, seed: int) -> Searched:
    """Let each other planner search for a path, until one finds one.

    Args:
        problem: The question.
        seconds: CPU time of all planners together, of which each has the same part [s].
        seed: A positive seed.
    """
    planners: list[str] = []
    spent = 0.0
    searches: list[tuple[str, Callable[..., Iterator[PeerRun]]]] = [("trees", _trees)]
    if has_ompl():
        searches.append(("OMPL", _ompl))
    seconds /= len(searches)
    for name, search in searches:
        planners.append(name)
        own = 0.0
        for run in search(problem, seconds, seed):
            own += run.cpu_seconds
            if run.found and not fault_of(problem, run.path):
                return Searched(tuple(planners), run.path, spent + own)
            if own >= seconds or not run.checks:
                break
        spent += own
    return Searched(tuple(planners), None, spent)


def _trees(problem: PlanningProblem, seconds: float, seed: int) -> Iterator[PeerRun]:
    while True:
        yield from run_trees(problem, (seed,), _CHECKS)
        seed += 1


def _ompl(problem: PlanningProblem, seconds: float, seed: int) -> Iterator[PeerRun]:
    yield from run_ompl(problem, (seed,), seconds)


def run_compiled_ompl(problem: PlanningProblem, seeds: Sequence[int], budget: float) -> tuple[PeerRun, ...]:
    """Run RRT-Connect once for every seed, with the team and the floor as constants of the compiled check.

    Args:
        problem: The question.
        seeds: Positive seeds.
        budget: CPU time of each run [s].
    """
    return run_ompl(problem, seeds, budget, _compiled_check(problem))


def _compiled_check(problem: PlanningProblem) -> Callable[..., bool]:
    team = team_arrays(problem.tree)
    grid = grid_for_team(problem.workspace, team)

    @numba.njit
    def check(*values: float) -> bool:
        free: bool = is_free(team, grid, np.array(values), 0.0)
        return free

    check(*map(float, problem.start))
    compiled: Callable[..., bool] = check
    return compiled
