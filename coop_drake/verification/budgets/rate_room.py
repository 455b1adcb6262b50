"""Whether nominal motions stay so far below limits of rate and acceleration that none acts."""

from __future__ import annotations

import numpy as np

from coop_drake.answers.plan import Transition
from coop_drake.errors import RefusalError
from coop_drake.tree.pose import FloatArray, IntArray


def check_rate_room(
    transition: Transition,
    made: FloatArray,
    last: FloatArray,
    members: IntArray,
    where: str,
) -> None:
    """Refuse sets in which a limit may act on a commanded acceleration a.

    It acts where |a| exceeds its own limit, or a times the rate g (limit^2 - rate^2) / 2. The sets are those
    of the law without limits.

    Args:
        transition: The transition, with its stated sets.
        made: Tubes of all parts, shape (samples, 6, b), see ``tubes``.
        last: Largest |acceleration| of each part after its tube's end, shape (b,).
        members: Axis of each part, shape (b,).
        where: The transition's place.

    Raises:
        RefusalError: Names the axis.
    """
    limits, stated = transition.gains.rate_limit, transition.tolerance
    gain, most = transition.gains.limit_gain, transition.gains.acceleration_limit
    if stated is None:
        return
    commanded = np.vstack([made[:, 4], last])
    for axis, limit in enumerate(() if most is None else most):
        if not (commanded[:, members == axis] <= limit).all():
            raise RefusalError(f"{where}[{axis}]", f"an axis may ask for more than its limit of {limit:.6g}")
    if limits is None or gain is None:
        return
    moving = np.abs(made[:, 2]) + made[:, 3]
    for axis, limit in enumerate(limits):
        of = members == axis
        rates = np.append(moving[:, of].ravel(), np.full(int(of.sum()), stated.settled_rate[axis]))
        asked = commanded[:, of].ravel()
        if not (rates * asked <= 0.5 * gain * (limit**2 - rates**2)).all():
            raise RefusalError(f"{where}[{axis}]", f"an axis may be damped by its limit of {limit:.6g}")
