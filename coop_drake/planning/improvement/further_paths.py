"""Plans along further paths: while the effort that was asked for lasts, the quickest plan is kept."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import ceil, inf

from shapely.errors import ShapelyError

from coop_drake.answers.plan import Plan
from coop_drake.errors import GeometryError, PatienceError, PlanError, StallError
from coop_drake.planning.boxes.channel import Channel, CoveredPath
from coop_drake.planning.execution.estimate import plan_time
from coop_drake.progress import Progress


def quicker_plans(
    found: Channel | CoveredPath,
    first: object,
    make: Callable[[CoveredPath], object],
    effort: float,
    progress: Progress | None,
) -> Iterator[Plan]:
    """Yield plans along other sampled paths, each of them quicker than all before it.

    Args:
        found: The path of the first plan; a channel that was found without a path has no further ones.
        first: The first plan, or what there is instead of one.
        make: Makes a plan along a path; what it returns that is no plan, or raises, is passed over.
        effort: As in ``PlannerSettings``; the first plan has taken 1, and every other path takes at most 1.
        progress: Called with the best estimate and the fraction of the effort that is spent. If it raises
            PatienceError, no further path is tried.
    """
    if not isinstance(found, CoveredPath):
        return
    best = plan_time(first) if isinstance(first, Plan) else inf
    for number in range(1, ceil(effort)):
        if progress is not None:
            so_far = f"; the transport takes {best:.1f} s so far" if best < inf else ""
            try:
                progress(f"trying another path{so_far}", number / effort)
            except PatienceError:
                return
        made = _tried(found, make, number, min(1.0, effort - number))
        if made is not None and plan_time(made) < best:
            best = plan_time(made)
            yield made


def _tried(
    found: CoveredPath, make: Callable[[CoveredPath], object], number: int, share: float
) -> Plan | None:
    """Return the plan along another path, None if there is none."""
    try:
        other = found.another(number, share)
        made = None if other is None else make(other)
    except (GeometryError, PlanError, StallError, ShapelyError):
        return None
    return made if isinstance(made, Plan) else None
