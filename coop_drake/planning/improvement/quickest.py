"""The plan to execute: the path is covered with other boxes, so that the transport takes less time."""

from __future__ import annotations

from dataclasses import replace

from shapely.errors import ShapelyError

from coop_drake.answers.digest import problem_digest
from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import GeometryError, PlanError, StallError, TooQuickError
from coop_drake.laws import GainSet
from coop_drake.planning.boxes.channel import Channel, CoveredPath
from coop_drake.planning.execution.channel_ends import check_ends, turned_to_start
from coop_drake.planning.execution.channel_path import path_through
from coop_drake.planning.execution.estimate import estimated, plan_time, timed
from coop_drake.planning.execution.speed_shares import NEED_FACTOR, limits_of
from coop_drake.planning.execution.transitions import keep_limits, make_plan, with_gains
from coop_drake.planning.improvement.path_covering import cover_path
from coop_drake.planning.search.rescaling import Rescaling
from coop_drake.progress import Progress
from coop_drake.tree.pose import FloatArray
from coop_drake.tree.usual_unit import usual_unit


def quickest_plan(
    problem: PlanningProblem,
    found: Channel | CoveredPath,
    gain_set: GainSet,
    *,
    gain_set_name: str,
    least_overlap: float = 0.0,
    progress: Progress | None = None,
) -> Plan:
    """Make a plan along the path of a search's result, with other boxes if these can be found.

    Teams of an unusual size are planned in a unit of length in which their size is usual.

    With the paper's fixed gains narrow scenarios often have no faster boxes; the plan then uses the boxes
    that the search found.

    Args:
        problem: What was asked.
        found: The channel that a search found, or a path that boxes cover.
        gain_set: Gains, fixed or to be scheduled.
        gain_set_name: Name under which the scenario knows them.
        least_overlap: Least overlap of consecutive boxes in every angle and joint [rad or m].
        progress: Called with a phase and the fraction of it that is done.

    Raises:
        GeometryError: If the boxes that the search found are needed and their polygons cannot be made.
        PlanError: If the channel does not join the start to the goal.
        StallError: If a passage is too narrow or too slow to be executed; names it.
        TooQuickError: If a limit of acceleration would act; names the joint.
    """
    unit = usual_unit(problem.tree)
    if unit == 1.0:
        return _quickest(problem, found, gain_set, gain_set_name, least_overlap, progress)
    scale = Rescaling(problem, unit)
    try:
        made = _quickest(
            scale.question(),
            scale.usual(found),
            scale.gains(gain_set),
            gain_set_name,
            least_overlap,
            progress,
        )
    except TooQuickError:
        raise
    except (GeometryError, PlanError, StallError) as error:
        raise StallError(f"{error} (these lengths are to be multiplied by {unit:g})") from error
    # Gains have bounds in metres: a team of another size moves at another pace than in its usual unit.
    plan = timed(with_gains(scale.plan(made), gain_set, gain_set_name))
    return replace(keep_limits(problem, plan, gain_set), problem=problem_digest(problem))


def _quickest(
    problem: PlanningProblem,
    found: Channel | CoveredPath,
    gain_set: GainSet,
    gain_set_name: str,
    least_overlap: float,
    progress: Progress | None,
) -> Plan:
    if isinstance(found, Channel):
        found = turned_to_start(problem, found)
        check_ends(problem, found)
    path = found.path if found.path is not None else path_through(problem, found)
    if progress is not None:
        progress("choosing boxes", 0.0)

    def covered(limits: FloatArray | None = None) -> Plan | None:
        better = cover_path(problem, path, found.margin, gain_set, least_overlap, limits)
        if better is None:
            return None
        try:
            return make_plan(
                problem, better.channel, gain_set, gain_set_name=gain_set_name, targets=better.targets,
                progress=progress,
            )  # fmt: skip
        except TooQuickError:  # other boxes would not be slower
            raise
        except (GeometryError, PlanError, StallError, ShapelyError):
            # The boxes that the search found are proved free too, and their passages may be wider.
            return None

    plan = covered()
    if plan is not None:
        slower = covered(limits_of(plan)) if _is_slowed(plan) else None
        return plan if slower is None or plan_time(plan) <= plan_time(slower) else slower
    channel = found if isinstance(found, Channel) else found.channel()
    return make_plan(problem, channel, gain_set, gain_set_name=gain_set_name, progress=progress)


def _is_slowed(plan: Plan) -> bool:
    """Whether limits of speed slow a plan down, so that other boxes may be quicker."""
    limits = limits_of(plan)
    return limits is not None and bool((NEED_FACTOR * estimated(plan)[1] > limits).any())
