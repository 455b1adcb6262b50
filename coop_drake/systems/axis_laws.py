"""The funnels and the gains of some axes, one entry for each cell of the plan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from coop_drake.answers.plan import Plan
from coop_drake.laws.funnels import Funnel
from coop_drake.laws.gains import TransitionGains
from coop_drake.laws.kernels import LAW_COLUMNS
from coop_drake.tree.pose import FloatArray

__all__ = ["AxisLaw", "axis_laws"]


@dataclass(frozen=True)
class AxisLaw:
    """Prescribed performance control of m axes in one cell.

    Attributes:
        funnel: Funnels of these axes, from the cell's slice to the transition's goal intervals.
        gains: Gains of the transition, per-axis arrays of shape (m,).
    """

    funnel: Funnel
    gains: TransitionGains

    @cached_property
    def table(self) -> FloatArray:
        """What the compiled laws read, shape (m, ``LAW_COLUMNS``), a row for each axis."""
        funnel, gains, rows = self.funnel, self.gains, np.empty((self.axes, LAW_COLUMNS))
        columns: tuple[FloatArray | float, ...] = (
            *funnel.kernel_arguments,
            gains.log_gain,
            gains.position_gain,
            gains.rate_gain,
            gains.energy_bound,
        )
        for column, values in enumerate(columns):
            rows[:, column] = values
        return rows

    @property
    def axes(self) -> int:
        """Number of axes m."""
        return int(self.funnel.goal_lower.size)


def axis_laws(plan: Plan, axes: Sequence[int]) -> tuple[AxisLaw, ...]:
    """Laws of some axes in every cell of a plan.

    Args:
        plan: The plan.
        axes: Indices into (theta, q...), in the order wanted.

    Raises:
        ValueError: The plan has no such axis.
    """
    count = len(plan.joint_names) + 1
    if any(not 0 <= axis < count for axis in axes):
        raise ValueError(f"axes {list(axes)} are not all in 0 to {count - 1}, the axes of the plan")
    chosen = np.array(axes, dtype=np.intp)
    laws = []
    for cell, transition in zip(plan.cells, plan.transitions, strict=True):
        goal, gains = (transition.goal_lower, transition.goal_upper), transition.gains
        funnel = Funnel(cell.lower, cell.upper, *goal, gains.decay_rate, gains.funnel)
        laws.append(AxisLaw(funnel.select(chosen), gains.select(chosen)))
    return tuple(laws)
