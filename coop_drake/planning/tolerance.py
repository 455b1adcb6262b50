"""A plan whose motion holds under a budget: the motion keeps so much room in its cells as the team needs.

How far the team may depart from a motion depends on how fast it is, and how fast it can be depends on the
room that is left. So the motion without a budget is planned first; then boxes, regions and the motion are
planned again with the room that this one would need, until a motion needs no more than it has. Where no such
motion is found, slower ones are tried.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import sqrt

import numpy as np
import shapely
from shapely import Point, Polygon
from shapely.errors import ShapelyError

from coop_drake.answers.budget import Budget, Departures
from coop_drake.answers.motion import Gains, Motion, TeamGains
from coop_drake.answers.plan import Plan, Transition
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import GeometryError, PlanError, StallError
from coop_drake.geometry.passage import PassageFinder, pole
from coop_drake.geometry.polygons import BoundaryDistance, component_at, parts_of
from coop_drake.laws import GainSet
from coop_drake.planning.cell_selection import quickest_plan
from coop_drake.planning.channel import Channel, CoveredPath
from coop_drake.planning.motion import quickest_motion
from coop_drake.planning.motion_limits import motion_limits
from coop_drake.planning.transitions import with_gains
from coop_drake.progress import Progress
from coop_drake.robustness.couplings import TeamCouplings, team_couplings
from coop_drake.robustness.tracking import (
    Moving,
    departures_of,
    goal_tolerances,
    largest_efforts,
    moving_of,
    speed_departures,
)
from coop_drake.tree.arrays import FloatArray

STIFFNESSES = (25.0, 50.0, 80.0, 120.0, 160.0, 200.0, 260.0, 350.0, 500.0)
"""K_t that are tried [1/s^2]: stiffer loops follow the noise more than they depart less."""

DAMPINGS = (1.4, 2.0, 2.6)
"""zeta_t over the root of K_t that are tried [-]: 2 is critical damping, 1.4 a damping ratio of 0.7."""

PACES = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4)
"""Shares of the limits of speed that motions are planned with, in this order [-]; those of accelerations are
the squares."""

SPARE = 1.04
"""Room that is planned with, over that which the motion before would need [-]: the next one is another."""

ROOMS = 4
"""How often cells and motion are planned again with more room, for each pace [-]."""

NEARLY = 1.2
"""Gains that need up to so many times the least room are as good [-]; the softest of them are taken."""

NO_PULL: TeamGains = (0.0, 0.0), (0.0, 0.0)
"""Gains of a motion that nobody follows."""

GAP = 1e-6
"""Regions have more room by this [m], more than rounding."""

MITRE_LIMIT = 2.0
"""Longest mitre over the room where a strip is taken off a region [-]; sharper corners are cut off."""

KEPT = 0.6
"""A target is kept if its clearance in the regions is this share of the largest there [-]."""

SHARES = (0.75, 0.5, 0.25, 0.1)
"""Shares of a budget that are tried where no plan holds under all of it [-]."""


@dataclass(frozen=True)
class BeyondBudget:
    """No plan was found that holds under a budget.

    Attributes:
        limit: What cannot be shown, in words.
        budget: The budget that was asked for.
        share: The largest of ``SHARES`` of it under which a plan holds, 0 where none was found.
    """

    limit: str
    budget: Budget
    share: float

    def describe(self) -> str:
        """Return which share of the budget holds, and what limits it, in full sentences."""
        said = f"No plan was found that holds under this budget: {self.limit}."
        if self.share == 0.0:
            return f"{said} Nor does one hold under {SHARES[-1]:.0%} of it."
        return f"{said} One holds under {self.share:.0%} of it: {self.budget.scaled(self.share).describe()}."


def tolerant_motion(
    problem: PlanningProblem,
    found: Channel | CoveredPath,
    gain_set: GainSet,
    *,
    gain_set_name: str,
    budget: Budget,
    progress: Progress | None = None,
) -> Plan | BeyondBudget:
    """Make a plan along a path that a search found, with a motion for which a budget holds.

    Args:
        problem: What was asked.
        found: What the search found.
        gain_set: The rule of the gains.
        gain_set_name: Name under which the scenario knows it.
        budget: The departures to be tolerated.
        progress: Called with a phase and the fraction of it that is done.

    Raises:
        GeometryError: As ``quickest_plan`` raises it; so are the others.
        PlanError: No plan can be made, or no motion through its cells.
        StallError: No plan can be executed.
    """
    question = _Question(problem, found, gain_set, gain_set_name, progress)
    made = question.held(budget)
    if isinstance(made, Plan):
        return made
    for share in SHARES:
        if isinstance(question.held(budget.scaled(share)), Plan):
            return BeyondBudget(made, budget, share)
    return BeyondBudget(made, budget, 0.0)


@dataclass(frozen=True)
class _Question:
    """What is asked, along which path."""

    problem: PlanningProblem
    found: Channel | CoveredPath
    gain_set: GainSet
    gain_set_name: str
    progress: Progress | None

    def held(self, budget: Budget) -> Plan | str:
        """Return a plan whose motion holds under a budget, or what cannot be shown, in words."""
        waiting, limits = 2.0 * budget.words_window, motion_limits(self.problem.limits)
        room = np.zeros(len(self.problem.start) - 1)
        plan = self._plan(room)
        motion = quickest_motion(plan, self.problem, limits, NO_PULL, waiting, room[1:])
        reasons = []
        for pace in PACES:
            slower = replace(motion, period=motion.period / pace, rates=pace * motion.rates)
            held = self._slower(budget, plan, slower, pace, limits, waiting)
            if isinstance(held, Plan):
                return held
            reasons.append(held)
        return reasons[0]

    def _slower(
        self, budget: Budget, plan: Plan, motion: Motion, pace: float, limits: FloatArray, waiting: float
    ) -> Plan | str:
        """Plan with room for what a motion needs, and again until the new one needs no more than it has."""
        room = np.zeros(len(self.problem.start) - 1)
        for attempt in range(ROOMS):
            team = team_couplings(budget, self.problem.tree, plan.cells)
            found = _least_departures(budget, moving_of(motion), team, goal_tolerances(self.problem))
            if isinstance(found, str):
                return found
            gains, away = found
            if attempt and (away.room <= room).all():  # Regions of the first plan have no room.
                return replace(plan, budget=budget, motion=replace(motion, gains=gains), departures=away)
            room = np.maximum(room, SPARE * away.room)
            noisy = speed_departures(self.problem.tree, self.problem.limits, away)
            kept = limits * [pace, pace * pace, pace**3]
            quickest = limits[1 : 1 + len(noisy), 0] - noisy
            kept[1 : 1 + len(noisy), 0] = np.minimum(kept[1 : 1 + len(noisy), 0], quickest)
            if not (kept[:, 0] > 0.0).all():
                return "what departs of speeds is as large as their limits"
            try:
                roomy = _with_room(self._plan(room), room[0])
                plan = with_gains(roomy, self.gain_set, self.gain_set_name)
                motion = quickest_motion(plan, self.problem, kept, gains, waiting, room[1:])
                _check_overlaps(motion, budget)
            except (GeometryError, PlanError, StallError, ShapelyError, np.linalg.LinAlgError) as error:
                sizes = f"{1e3 * room[0]:.0f} mm and {1e3 * room[1:].max():.0f} mrad or mm"
                return f"with room for departures of {sizes}, {error}"
        return "the room for departures does not settle"

    def _plan(self, room: FloatArray) -> Plan:
        """Return a plan whose boxes have so much room."""
        name, progress = self.gain_set_name, self.progress
        return quickest_plan(
            self.problem, self.found, self.gain_set, gain_set_name=name, room=room, progress=progress
        )


def _least_departures(
    budget: Budget, moving: Moving, team: TeamCouplings, tolerances: FloatArray
) -> tuple[TeamGains, Departures] | str:
    """Return the gains with which a motion needs least room, and the departures; or why none do.

    Args:
        budget: The budget.
        moving: Bounds of the motion.
        team: What the masses couple in the cells.
        tolerances: Those of the goal, of position, theta and q, shape (2 + n,) [m, rad].
    """
    stable = list[tuple[Gains, Departures]]()
    for stiffness in STIFFNESSES:
        for factor in DAMPINGS:
            alike = stiffness, factor * sqrt(stiffness)
            away = departures_of((alike, alike), budget, moving, team.couplings)
            if away is not None:
                stable.append((alike, away))
    if not stable:
        return "no gains hold the team to its motion under the delay, the lag and the model's error"

    def softest(part: slice) -> Gains:
        """Of gains that need hardly more room than the least, those that follow the noise least.

        Gains that leave the team too far from its goal only count where there are no others.
        """
        near_goal = [found for found in stable if (found[1].rest[part] <= tolerances[part]).all()]
        rooms = [(own, float(away.room[part].max())) for own, away in near_goal or stable]
        least = min(room for _, room in rooms)
        return min((own for own, room in rooms if room <= NEARLY * least), key=lambda own: own[1])

    gains = softest(slice(0, 1)), softest(slice(1, None))
    best = departures_of(gains, budget, moving, team.couplings)
    assert best is not None  # each of its loops is stable
    if not (best.rest <= tolerances).all():
        axis = int(np.argmax(best.rest / tolerances))
        return (
            f"the team may rest {1e3 * best.rest[axis]:.1f} mm or mrad from its goal, and the tolerance is "
            f"{1e3 * tolerances[axis]:g} mm or mrad"
        )
    if team.efforts is None:
        return gains, best
    asked = largest_efforts(budget, gains, team.efforts, moving, best)
    over = asked / team.efforts.limits
    if not (over <= 1.0).all():
        worst = int(np.argmax(over))
        name, limit = team.efforts.names[worst], team.efforts.limits[worst]
        return f"{name} may be told to give {asked[worst]:.4g}; its limit is {limit:g}"
    return gains, replace(best, effort=asked)


def _check_overlaps(motion: Motion, budget: Budget) -> None:
    """Refuse a motion that lies in two cells at once for less than phases of robots may differ by.

    Raises:
        PlanError: Names the cells.
    """
    overlaps, least = motion.windows[:-1, 1] - motion.windows[1:, 0], 2.0 * budget.clock_error
    if (overlaps < least).any():
        k = int(np.argmin(overlaps))
        raise PlanError(
            f"cells {k} and {k + 1} overlap for {overlaps[k]:.3g} s, and by wrong clocks robots may differ "
            f"by {least:g} s"
        )


# Regions without their outer strip, and paths in them.


def _with_room(plan: Plan, room: float) -> Plan:
    """Return a plan whose regions are farther than a room from the boundaries of their cells.

    Raises:
        GeometryError: A region does not join where it is entered to where it is left.
        PlanError: Two regions do not meet.
    """
    strips = shapely.buffer(
        [cell.tidied for cell in plan.cells], -(room + GAP), join_style="mitre", mitre_limit=MITRE_LIMIT
    )
    entry, regions, targets = plan.start[:2], list[Polygon](), list[FloatArray]()
    for k, transition in enumerate(plan.transitions):
        regions.append(component_at(strips[k], Point(entry)))
        targets.append(
            _target(regions[k], strips[k + 1], transition, k)
            if k + 1 < len(plan.cells)
            else transition.target
        )
        if not regions[k].contains(Point(targets[k])):
            raise PlanError(f"cell {k} has no way to where it is left")
        entry = targets[k]
    entries, transitions = (plan.start[:2], *targets[:-1]), []
    for k, (region, transition) in enumerate(zip(regions, plan.transitions, strict=True)):
        passage = PassageFinder(region).find(entries[k], targets[k])
        transitions.append(
            replace(
                transition, target=targets[k], governed=region, neck=passage.clearance,
                path=shapely.get_coordinates(passage.path), length=passage.length,
            )
        )  # fmt: skip
    return replace(plan, transitions=tuple(transitions))


def _target(region: Polygon, following: Polygon, transition: Transition, k: int) -> FloatArray:
    """Return where two regions meet: the target of a transition, or one with more clearance."""
    parts = parts_of(region.intersection(following))
    if not parts:
        raise PlanError(f"cells {k} and {k + 1} do not meet")
    best, clearance = max((pole(part) for part in parts), key=lambda found: found[1])
    own = next((part for part in parts if part.contains(Point(transition.target))), None)
    if own is not None and BoundaryDistance(own)(transition.target) >= KEPT * clearance:
        return transition.target
    return np.asarray(best)
