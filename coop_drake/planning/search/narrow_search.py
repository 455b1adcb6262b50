"""Search through passages that are too narrow for samples: paths on larger floors are repaired."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import product

from coop_drake.answers.problem import PlanningProblem
from coop_drake.planning.sampling.guided_samples import GuidePath
from coop_drake.planning.sampling.narrow_passages import centred, repaired, widened_floor
from coop_drake.planning.sampling.sampler import Sampler
from coop_drake.planning.sampling.subsystems import SubsystemHierarchy
from coop_drake.planning.search.attempt import BoxSequence, Tried
from coop_drake.tree.pose import FloatArray

BODY_GAP = 0.01
"""Distance that paths keep between bodies of the team [m]."""

FLOOR_GROWTHS, SEEDS_PER_GROWTH = (0.1, 0.06, 0.03), 2
"""Amounts by which walls are moved back for paths through narrow passages [m], largest first because these
are the easiest to sample, and random seeds for each of them."""

NARROW_SAMPLES = 16_000
"""Samples for every subsystem on these floors: fewer often find no path near the critical width."""

CENTRED_PATHS, CENTRED_SHORT = 3, 0.005
"""So many of these paths, those that fit the floor best, are moved to the middle of their passages; those
that still need the walls this far back are left out [m]."""

Covered = Callable[[FloatArray, bool], BoxSequence | None]
"""Covers a path with boxes that are proved free, the smallest ones if its second argument says so."""


class NarrowSearch:
    """Samples paths on larger floors, repairs them until they fit the floor, and covers them with boxes.

    Args:
        problem: The question.
        hierarchy: Its subsystems.
        covered: Covers a path with boxes.
    """

    def __init__(self, problem: PlanningProblem, hierarchy: SubsystemHierarchy, covered: Covered) -> None:
        self._problem, self._hierarchy, self._covered = problem, hierarchy, covered

    def tries(
        self, number: int, progress: Callable[[float], None] | None, *, object_first: bool
    ) -> list[Callable[[], Tried]]:
        """The attempts of one round as functions to call, with other random numbers in every round.

        The first round adds robot after robot, later ones sample all robots at once: added one by one they
        go where the object alone goes most easily.

        Args:
            number: The round, counted from 0.
            progress: Called with the fraction of an attempt that is done.
            object_first: Whether attempts of later rounds repair a path of the object alone first, and end
                where it does not fit the floor. This is not done for parts of the team with robots: their
                paths are repaired to other places than the team's, and ways were lost by it.
        """
        first = SEEDS_PER_GROWTH * max(0, number - 1)
        seeds = range(first, first + SEEDS_PER_GROWTH)
        ways = product(seeds, FLOOR_GROWTHS)
        return [partial(self._repaired, number > 0, object_first, *way, progress) for way in ways]

    def _repaired(
        self,
        direct: bool,
        object_first: bool,
        seed: int,
        growth: float,
        progress: Callable[[float], None] | None,
    ) -> Tried:
        """Sample a path on a larger floor, repair it, and cover it if it fits."""
        floor = widened_floor(self._problem.workspace, growth)
        sampler = Sampler(self._hierarchy, floor, BODY_GAP, seed, progress)
        if not direct:
            path = sampler.path(NARROW_SAMPLES)
        elif object_first:
            guide = self._repaired_object(sampler, growth)
            if guide is None:
                return Tried()
            path = sampler.path_around(guide, NARROW_SAMPLES)
        else:
            path = sampler.direct_path(NARROW_SAMPLES)
        if not len(path):
            return Tried()
        path, short = repaired(self._problem, path, growth)
        found = None if short > 0.0 else self._covered(path, False)
        return Tried(found, path, short=short)

    def _repaired_object(self, sampler: Sampler, growth: float) -> GuidePath | None:
        """Path of the object alone, repaired; None if there is none that almost fits the floor."""
        guide = sampler.direct((), NARROW_SAMPLES)
        if guide is None:
            return None
        path, short = repaired(self._hierarchy.subsystem(()).question, guide.path, growth)
        return None if short > CENTRED_SHORT else GuidePath(path, guide.joints)

    def through_middle(self, done: Sequence[Tried]) -> BoxSequence | None:
        """Cover the path of one of some attempts, those that fit best first, in the middle of its passages.

        The boxes are the smallest ones, so a transport through them takes long.
        """
        fitting = [
            (one.short, one.path) for one in done if one.path is not None and one.short < CENTRED_SHORT
        ]
        for needed, path in sorted(fitting, key=lambda one: one[0])[:CENTRED_PATHS]:
            moved, short = centred(self._problem, path, needed)
            found = None if short > 0.0 else self._covered(moved, True)
            if found is not None:
                return found
        return None
