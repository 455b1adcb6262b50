"""A random planning question by seed and number, as a scenario file with its models."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path

import numpy as np
import shapely
from shapely import Polygon

from benchmarks.questions.floors import Random, RandomFloor, random_floor
from benchmarks.questions.settings import QuestionSettings
from benchmarks.questions.teams import RandomTeam, random_count, random_team
from coop_drake.answers import PlanningProblem
from coop_drake.errors import CoopDrakeError, ScenarioError
from coop_drake.files import write_atomically
from coop_drake.jit import compiled
from coop_drake.planning.sampling.collision import ALL, bodies_apart, grid_for_team, is_free
from coop_drake.plant import planning_problem
from coop_drake.scenario import Goal, ObjectPose, Scenario, Start, Workspace, dump_scenario, load_scenario
from coop_drake.scenario.model import DirectiveEntry, RobotLimits
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import ComponentTree, TeamArrays, axis_levers, place_into

_DRAWN, _REFINED = 4_000, 8_000
"""Configurations drawn anywhere, and drawn near the best one so far [-]: together some 20 ms."""

_FINEST = 1e-4
"""Final size of the neighbourhood in which configurations are drawn, as a fraction of the ranges [-]."""


def narrowest_corridor(tree: ComponentTree, random: np.random.Generator) -> float:
    """Return the width of the narrowest straight corridor that was found to hold the team [m].

    It is an upper bound of the critical width of a long corridor, and of a door no bound: bodies may pass one
    after the other.

    Args:
        tree: The team.
        random: Source of the samples.
    """
    lower = np.array([0.0, 0.0, -np.pi, *tree.range_lower])
    upper = np.array([0.0, 0.0, np.pi, *tree.range_upper])
    return float(_narrowest(tree.arrays, lower, upper, random, _DRAWN, _REFINED))


@compiled
def _narrowest(
    team: TeamArrays,
    lower: FloatArray,
    upper: FloatArray,
    random: np.random.Generator,
    drawn: int,
    refined: int,
) -> float:
    """Least extent along y of all configurations drawn whose bodies are apart [m]."""
    least, best, poses = inf, np.zeros(len(lower)), np.empty((len(team.links), 5))
    for k in range(drawn + refined):
        z = lower + random.random(len(lower)) * (upper - lower)
        if k >= drawn and least < inf:
            spread = 0.2 * (_FINEST / 0.2) ** ((k - drawn) / refined)
            z = np.minimum(np.maximum(best + spread * (z - 0.5 * (lower + upper)), lower), upper)
        place_into(team, z, poses)
        extent = _extent(team, poses)
        if extent < least and bodies_apart(team, poses, 0.0, ALL):
            least, best = extent, z
    return least


@compiled
def _extent(team: TeamArrays, poses: FloatArray) -> float:
    """Extent of a placed team along y [m]."""
    low, high = inf, -inf
    for piece in range(len(team.pieces)):
        X, radius = poses[team.pieces[piece, 0]], team.radii[piece]
        for v in range(team.pieces[piece, 1], team.pieces[piece, 2]):
            y = X[1] + X[3] * team.vertices[v, 0] + X[2] * team.vertices[v, 1]
            low, high = min(low, y - radius), max(high, y + radius)
    return high - low


_DRAFTS = 200
"""Teams and floors that are drawn for one question at most; usually a handful suffices."""

_TRIES = 2_000
"""Configurations drawn for a start or a goal; a floor on which none is free is drawn anew."""

_CANDIDATES = 4
"""Free goals of which the one that is furthest from the start is taken."""

_GAP = 1e-3
"""Bodies of starts and goals are at least this far apart [m], so that rounding does not let them touch."""

_GOAL_JOINTS = 0.25
"""Fraction of questions in which one robot has a goal of its own [-]."""

_DIGITS = 6
"""Decimals of coordinates in the scenario file."""

_LIMITS = {"*": RobotLimits(base_speed=1.0, base_turn_rate=2.0)}
"""Speeds of usual mobile bases [m/s, rad/s]."""


class QuestionError(CoopDrakeError):
    """No question could be drawn."""


@dataclass(frozen=True)
class Question:
    """A random question, written as a scenario file.

    Attributes:
        number: Its number in the campaign; seed and number determine it.
        seed: Its seed.
        scenario: The scenario; ``scenario.path`` is its file, beside which its models are.
        problem: What the planner is asked.
        floor: Kind of the floor.
        kind: The object's shape, and whether joints slide.
        robots: Number of robots.
        width_ratio: Width of the floor's passages over that of the narrowest straight corridor in which the
            team is known to fit [-]; NaN on floors without passages of one width.
    """

    number: int
    seed: int
    scenario: Scenario
    problem: PlanningProblem
    floor: str
    kind: str
    robots: int
    width_ratio: float


def random_question(settings: QuestionSettings, number: int, folder: Path) -> Question:
    """Draw a question and write its files into a folder, which is made if it is missing.

    Start and goal are free of collisions; whether there is a way between them is the question.

    Args:
        settings: The seeds, and what may be drawn.
        number: Number of the question.
        folder: Where the scenario and its models are written.

    Raises:
        QuestionError: The settings allow no question.
    """
    seed = settings.seed(number)
    random = np.random.default_rng([seed, number])
    kind = settings.floors[int(random.integers(len(settings.floors)))]
    robots = random_count(random, settings.robots)
    folder.mkdir(parents=True, exist_ok=True)
    for _ in range(_DRAFTS):
        drawn = random_team(random, robots, settings.most_joints)
        if drawn is None:
            continue
        path = folder / f"question_{seed}_{number}.scenario.yaml"
        tree = _tree(drawn, path)
        if tree is None:
            continue
        narrowest = narrowest_corridor(tree, random)
        floor = random_floor(random, kind, axis_levers(tree)[0], narrowest)
        ends = None if floor is None else _ends(random, floor, tree)
        if floor is None or ends is None:
            continue
        scenario = _scenario(random, drawn, floor, ends, path)
        write_atomically(path, dump_scenario(scenario).encode())
        scenario = load_scenario(path)
        ratio = floor.width / narrowest
        return Question(number, seed, scenario, planning_problem(scenario), kind, drawn.kind, robots, ratio)
    raise QuestionError(f"no question {number} of seed {seed} was found among {_DRAFTS} teams and floors")


def _tree(team: RandomTeam, path: Path) -> ComponentTree | None:
    """Write and read the models of a team; None if its bodies touch in the middle of its joints' ranges."""
    for name, text in team.models().items():
        write_atomically(path.with_name(name), text.encode())
    # In the middle of their ranges joints get no room beyond their limits.
    still = np.array([0.0] * 3 + [-0.5 * (slide or 0.0) for arm in team.arms for slide in arm.slides])
    try:
        far = shapely.box(-100.0, -100.0, 100.0, 100.0)
        return planning_problem(_stated(team, far, still, Goal(ObjectPose(0.0, 0.0, 0.0)), path)).tree
    except ScenarioError:
        return None


def _ends(random: Random, floor: RandomFloor, tree: ComponentTree) -> tuple[FloatArray, FloatArray] | None:
    """A free start in the floor's first region, and of some free goals in its last one the furthest."""
    starts = list(_free(random, floor.polygon, floor.first, tree, 1))
    goals = list(_free(random, floor.polygon, floor.last, tree, _CANDIDATES)) if starts else []
    if not goals:
        return None
    return starts[0], max(goals, key=lambda goal: float(np.hypot(*(goal - starts[0])[:2])))


def _free(
    random: Random, floor: Polygon, region: Polygon, tree: ComponentTree, count: int
) -> Iterator[FloatArray]:
    """At most ``count`` configurations without collision whose object's origin is in a region."""
    team = tree.arrays
    grid = grid_for_team(floor.buffer(-_GAP), team)
    found = 0
    for _ in range(_TRIES):
        position = random.uniform(region.bounds[:2], region.bounds[2:])
        joints = random.uniform(tree.range_lower, tree.range_upper)
        z = np.array([*position, random.uniform(-np.pi, np.pi), *joints]).round(_DIGITS)
        inside = shapely.contains_xy(region, *position)
        if inside and found < count and is_free(team, grid, z, _GAP):
            found += 1
            yield z
        if found == count:
            return


def _scenario(
    random: Random, team: RandomTeam, floor: RandomFloor, ends: Sequence[FloatArray], path: Path
) -> Scenario:
    """The scenario of a question; sometimes one robot's joints have goals."""
    start, end = ends
    goal = Goal(ObjectPose(*end[:3].tolist()))
    if random.random() < _GOAL_JOINTS:
        robot = str(random.choice(team.names))
        goal = replace(goal, joints={robot: _joints(team, end)[robot]})
    return _stated(team, floor.polygon, start, goal, path)


def _stated(team: RandomTeam, floor: Polygon, start: FloatArray, goal: Goal, path: Path) -> Scenario:
    rings = [
        tuple((float(x), float(y)) for x, y in shapely.get_coordinates(ring)[:-1])
        for ring in (floor.exterior, *floor.interiors)
    ]
    directives: list[object] = [{"add_model": {"name": "object", "file": "object.sdf"}}]
    directives += [{"add_model": {"name": name, "file": f"{name}.sdf"}} for name in team.names]
    directives += [
        {"add_weld": {"parent": f"object::grasp_{k}", "child": f"{name}::gripper"}}
        for k, name in enumerate(team.names)
    ]
    return Scenario(
        Workspace(rings[0], tuple(rings[1:])),
        tuple(map(DirectiveEntry, directives)),
        Start(ObjectPose(*start[:3].tolist()), _joints(team, start)),
        goal,
        limits=_LIMITS,
        path=path,
    )


def _joints(team: RandomTeam, z: FloatArray) -> dict[str, tuple[float, ...]]:
    """Values of every robot's joints."""
    values, joints, first = z[3:].tolist(), {}, 0
    for name, arm in zip(team.names, team.arms, strict=True):
        joints[name] = tuple(values[first : first + len(arm.slides)])
        first += len(arm.slides)
    return joints
