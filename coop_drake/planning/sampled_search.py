"""Search by sampled paths: a path is sampled, smoothed and covered with boxes that are proved free."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property, partial
from itertools import product

import numpy as np
from shapely.errors import ShapelyError

from coop_drake.answers.problem import PlanningProblem, at_goal, goal_box
from coop_drake.errors import GeometryError
from coop_drake.geometry.swept_tree import SweptTree
from coop_drake.planning.boxes import free_boxes
from coop_drake.planning.cells.cells import FreeBox
from coop_drake.planning.channel import Channel, CoveredPath, Regions, make_channel
from coop_drake.planning.questions import (
    ending_at,
    exact_footprint,
    marginal_workspace,
    shrunk,
    within_limits,
)
from coop_drake.planning.sampling.band import (
    BODY_GAP,
    another_candidate,
    best_candidate,
    kept_margin,
    moved_from_obstacles,
    smoothed,
)
from coop_drake.planning.sampling.collision import ObstacleGrid, grid_for_team, is_free
from coop_drake.planning.sampling.narrow_passages import centred, repaired, widened_floor
from coop_drake.planning.sampling.sampler import FEW_JOINTS, Sampler, SubsystemHierarchy
from coop_drake.planning.sampling.trees import GuidePath
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import configuration_scale

# What comes of one attempt to sample a path and to cover it with boxes.

FEW_SAMPLES, MANY_SAMPLES = 4_000, 16_000
"""Samples for every subsystem in the first attempts, enough for most floors at a tenth of a second, and in
those that follow, about a second each."""

LIGHT_ATTEMPTS = 4
"""Attempts with few samples, before those with many begin."""

SHARES = (1, 1, 2)
"""Attempts draw so many times as many, in turns [-]: twice as many take three times as long."""


def samples_of_attempt(number: int) -> int:
    """Samples for every subsystem in an attempt, counted from 1: few at first, then many."""
    if number <= LIGHT_ATTEMPTS:
        return FEW_SAMPLES * SHARES[(number - 1) % len(SHARES)]
    return MANY_SAMPLES * SHARES[(number - LIGHT_ATTEMPTS - 1) % len(SHARES)]


# Search through passages that are too narrow for samples: paths on larger floors are repaired.

FLOOR_GROWTHS, SEEDS_PER_GROWTH = (0.1, 0.06, 0.03), 2
"""Amounts by which walls are moved back for paths through narrow passages [m], largest first because these
are the easiest to sample, and random seeds for each of them."""

NARROW_SAMPLES = 16_000
"""Samples for every subsystem on these floors: fewer often find no path near the critical width."""

CENTRED_PATHS, CENTRED_SHORT = 3, 0.005
"""So many of these paths, those that fit the floor best, are moved to the middle of their passages; those
that still need the walls this far back are left out [m]."""

CLEARANCES = (0.015, 0.01), (0.002, 0.002)
"""Clearances from the walls, and distances between bodies of the team, with which paths are sampled, in turns
[m]: the larger ones leave space for long boxes, the smaller ones let narrow passages through."""

FIRST_SMOOTHINGS = (0.05, 600), (0.05, 3_000)
"""Spacing of samples [m] and number of moves with which a new path is smoothed; the longer smoothing follows
only if boxes cannot cover the path after the shorter one."""


class SampledSearch:
    """Finds a path that boxes cover, then moves it away from the walls.

    What it finds is proved by the boxes, whatever was sampled. If it finds nothing, that is no proof.

    Args:
        problem: The question.
        route: A route for a disc inside the object, around which paths are sampled, shape (k, 2) [m]; None:
            the disc's path is sampled, too.

    Attributes:
        slices: Boxes tried so far.
        object_blocked: Number of attempts in a row in which no path was found even for the object alone.
    """

    def __init__(self, problem: PlanningProblem, route: FloatArray | None = None) -> None:
        self._problem = problem
        self._scale = configuration_scale(problem.tree)
        self._hierarchy = SubsystemHierarchy(problem, route)
        self._start_inside = problem.workspace.contains(exact_footprint(problem.tree, problem.start))
        self._attempts = 0
        self.slices = 0
        self.object_blocked = 0

    def attempts(
        self,
        number: int,
        progress: Callable[[float], None] | None = None,
        part: tuple[int, ...] | None = None,
    ) -> Iterator[CoveredPath | None]:
        """Sample some paths and cover each of them, all with other samples.

        Args:
            number: How many.
            progress: Called with the fraction of an attempt that is done.
            part: Robots for which, with the object alone, a path seems hard to find: it is sampled first.

        Yields:
            The boxes along the path of each attempt, None if no path was found or covered.
        """
        for _ in range(number):
            found, self._attempts = None, self._attempts + 1
            with suppress(GeometryError, ShapelyError):
                if self._start_inside:
                    found, blocked = self._attempt(self._attempts, progress, part=part)
                    self.object_blocked = self.object_blocked + 1 if blocked else 0
            yield found

    def around(self, guide: FloatArray) -> CoveredPath | None:
        """Sample paths around another one, which need not be free, and cover them.

        Args:
            guide: Configurations, circular axes unwrapped, shape (m, 3 + n) [m, rad].

        Returns:
            The boxes, or None if no path was found or covered.
        """
        if not self._start_inside:
            return None
        for number in range(LIGHT_ATTEMPTS + 1, LIGHT_ATTEMPTS + 1 + len(CLEARANCES)):
            with suppress(GeometryError, ShapelyError):
                found, _ = self._attempt(number, None, guide)
                if found is not None:
                    return found
        return None

    def _attempt(
        self,
        number: int,
        progress: Callable[[float], None] | None,
        guide: FloatArray | None = None,
        part: tuple[int, ...] | None = None,
    ) -> tuple[CoveredPath | None, bool]:
        """The boxes along a sampled path, if any, and whether no path was found even for the object alone."""
        clearance, gap = CLEARANCES[(number - 1) % len(CLEARANCES)]
        workspace = marginal_workspace(self._problem, clearance)
        sampler = Sampler(self._hierarchy, workspace, gap, number - 1, progress)
        direct = number > 1 or len(self._problem.goal_joints) > FEW_JOINTS
        samples = samples_of_attempt(number)
        if guide is None:
            # Samples anywhere take as long as all others, and hardly ever help where these did not.
            path = (
                sampler.direct_path(samples, part, anywhere=number > 1) if direct else sampler.path(samples)
            )
        else:
            joints = tuple(range(guide.shape[1] - 3))
            path = sampler.path_around(GuidePath(guide, joints), samples)
        found = None
        for spacing, moves in FIRST_SMOOTHINGS if len(path) else ():
            path = smoothed(self._problem, path, clearance, 0.0, gap, spacing, moves)
            found = self._covered(path)
            if found is not None:
                break
        return found, sampler.object_blocked

    def narrow_attempt(
        self,
        number: int,
        progress: Callable[[float], None] | None = None,
        *,
        object_first: bool = False,
    ) -> CoveredPath | None:
        """Look for a path through passages that are too narrow for samples, and cover it.

        Paths are first sought on floors that are larger, and repaired until they fit the floor. The best of
        those that almost fit are moved to the middle of their passages. They are covered with the smallest
        boxes, through which a transport takes long.

        Args:
            number: How many such attempts there were before; each has other random numbers.
            progress: Called with the fraction of a path that is done.
            object_first: Whether, but in the first attempt, a path of the object alone is to be found and
                repaired before one of the team. This is not done for parts of the team with robots: their
                paths are repaired to other places than the team's, and ways were lost by it.

        Returns:
            The boxes, or None if no path was found or covered.
        """
        first = SEEDS_PER_GROWTH * max(0, number - 1)
        ways = product(range(first, first + SEEDS_PER_GROWTH), FLOOR_GROWTHS)
        fitting = list[tuple[float, FloatArray]]()
        with suppress(GeometryError, ShapelyError):
            for seed, growth in ways if self._start_inside else ():
                path = self._on_larger_floor(number > 0, object_first, seed, growth, progress)
                if not len(path):
                    continue
                path, short = repaired(self._problem, path, growth)
                found = None if short > 0.0 else self._covered(path)
                if found is not None:
                    return found
                if short < CENTRED_SHORT:
                    fitting.append((short, path))
            for needed, path in sorted(fitting, key=lambda one: one[0])[:CENTRED_PATHS]:
                moved, short = centred(self._problem, path, needed)
                found = None if short > 0.0 else self._covered(moved, smallest=True)
                if found is not None:
                    return found
        return None

    def _on_larger_floor(
        self,
        direct: bool,
        object_first: bool,
        seed: int,
        growth: float,
        progress: Callable[[float], None] | None,
    ) -> FloatArray:
        """Sample a path with walls moved back; no rows if none is found.

        The first attempt adds robot after robot, later ones sample all robots at once: added one by one they
        go where the object alone goes most easily.
        """
        floor = widened_floor(self._problem.workspace, growth)
        sampler = Sampler(self._hierarchy, floor, BODY_GAP, seed, progress)
        if not direct:
            return sampler.path(NARROW_SAMPLES)
        if not object_first:
            return sampler.direct_path(NARROW_SAMPLES)
        guide = sampler.direct((), NARROW_SAMPLES)
        if guide is None:
            return np.empty((0, len(self._problem.start)))
        path, short = repaired(self._hierarchy.subsystem(()).question, guide.path, growth)
        if short > CENTRED_SHORT:
            return np.empty((0, len(self._problem.start)))
        return sampler.path_around(GuidePath(path, guide.joints), NARROW_SAMPLES)

    def with_margin(self, first: CoveredPath, share: float = 1.0) -> CoveredPath:
        """Move the best path away from the walls, and cover it.

        Args:
            first: A path that is covered.
            share: Share of the usual work that is spent on the path [-].

        Returns:
            The path moved; the first one if the moved one cannot be covered.
        """
        near = best_candidate(self._problem, self._hierarchy, first.path, share)
        return self._moved(near, share) or first

    def another(self, number: int, share: float) -> CoveredPath | None:
        """Find another path by other samples; see ``CoveredPath``."""
        try:
            near = another_candidate(self._problem, self._hierarchy, number, share)
            return None if near is None else self._moved(near, share)
        except (GeometryError, ShapelyError):
            return None

    def _moved(self, near: FloatArray, share: float) -> CoveredPath | None:
        """Move a path away from the walls, and cover it."""
        path = moved_from_obstacles(self._problem, near, share)
        return self._covered(path, kept_margin(self._problem, path))

    def _covered(
        self, path: FloatArray, margin: float = 0.0, *, smallest: bool = False
    ) -> CoveredPath | None:
        """Cover a path, which keeps a margin at its samples, with boxes."""
        tree, floor = self._problem.tree, self._problem.workspace
        boxes, trials = free_boxes(tree, floor, self._scale, path, smallest=smallest)
        self.slices += trials
        if boxes is None:
            return None
        return CoveredPath(path, margin, partial(self._channel, boxes, path, margin), self.another)

    @cached_property
    def _swept(self) -> SweptTree:
        """Sweeps for the channels of all paths."""
        return SweptTree(self._problem.tree)

    def _channel(self, boxes: Sequence[FreeBox], path: FloatArray, margin: float) -> Channel:
        """Boxes along a path with all positions that are free for them.

        Raises:
            GeometryError: If geometry fails.
        """
        regions = Regions(self._problem, self._swept)
        made = [regions.around(box) for box in boxes]
        free = [box for box in made if box is not None]
        if len(free) < len(boxes):
            raise GeometryError("the free positions of the boxes along a path cannot be computed")
        ends = np.array([box.positions[-1] for box in boxes])
        return replace(make_channel(self._problem, free, path), ends=ends, margin=margin)


# A free end within the goal's tolerances, where the middle of the goal is not free.

ENDS, TRIED_AT_END = 64, 16
"""Ends that are tried, and values of the free joints that are tried at each [-]."""

END_DISTANCES = (0.015, 0.005, 0.002, 0.0)
"""Distances from walls that an end shall keep, in the order tried [m]."""

WITHIN_GOAL = 0.9
"""Share of the tolerances that ends lie in, so that some of them is left about an end [-]."""


def ending_freely(problem: PlanningProblem) -> PlanningProblem | None:
    """The question of ending at a free configuration of the goal, if one is found and its middle is not free.

    A middle that is nearer to walls than ``planner.min_clearance`` is left for an end that is not. Of ends
    that keep the same distance from walls it is the one about which most of the tolerances is left.
    """
    middle, random = within_limits(problem), np.random.default_rng(0)
    middles, least = _ends_in(problem, random, 0.0), problem.settings.min_clearance
    free = middle is problem and len(_free_ends(problem, middles, 0.0)) > 0
    if free and _free_ends(problem, middles, least):
        return None
    ends = _ends_in(problem, random, WITHIN_GOAL)
    for distance in END_DISTANCES:
        if free and distance < least:
            return None
        asked = [ending_at(problem, end) for end in _free_ends(problem, ends, distance)]
        if asked:
            return max(asked, key=lambda one: _least_left(one, problem))
    return None


def _ends_in(problem: PlanningProblem, random: np.random.Generator, share: float) -> FloatArray:
    """Configurations in a share of the goal, or in its middle, with values of the free joints, (k, 3 + n)."""
    low, high = np.array(goal_box(problem)).T
    aimed = np.array([True, *[goal is not None for goal in problem.goal_joints]])
    middle = at_goal(problem.goal_pose, problem.goal_joints, 0.0)[2:] if share == 0.0 else 0.5 * (low + high)
    spread = np.repeat(random.uniform(-share, share, (ENDS, len(low))), TRIED_AT_END, axis=0)
    spread[:, ~aimed] = random.uniform(-1.0, 1.0, (ENDS * TRIED_AT_END, int((~aimed).sum())))
    axes = np.where(aimed, middle, 0.5 * (low + high)) + 0.5 * (high - low) * spread
    away = problem.position_tolerance * share * np.sqrt(random.random(ENDS))
    turn = random.uniform(0.0, 2.0 * np.pi, ENDS)
    places = problem.goal_pose[:2] + np.column_stack((away * np.cos(turn), away * np.sin(turn)))
    return np.column_stack((np.repeat(places, TRIED_AT_END, axis=0), axes))


def _free_ends(problem: PlanningProblem, ends: FloatArray, distance: float) -> list[FloatArray]:
    """Those of some ends that are free and keep a distance from walls [m]."""
    team = problem.tree.arrays
    try:
        grid: ObstacleGrid = grid_for_team(shrunk(problem.workspace, distance), team)
    except GeometryError:
        return []
    return [end for end in ends if is_free(team, grid, end, 0.0)]


def _least_left(asked: PlanningProblem, problem: PlanningProblem) -> float:
    """The least share of a tolerance that is left about an end [-]."""
    joints = np.asarray(asked.joint_tolerance) / problem.joint_tolerance
    position = asked.position_tolerance / problem.position_tolerance
    angle = asked.angle_tolerance / problem.angle_tolerance
    return float(min(position, angle, joints.min(initial=1.0)))
