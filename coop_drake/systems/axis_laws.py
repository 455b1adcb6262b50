"""The funnels and the gains of some axes, one entry for each cell of the plan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from coop_drake.answers.plan import Plan
from coop_drake.laws.axis_table import axis_table
from coop_drake.laws.funnels import Funnel
from coop_drake.laws.gains import TransitionGains
from coop_drake.tree.pose import FloatArray


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
        """The ``axis_table`` of these axes, shape (m, ``LAW_COLUMNS``)."""
        return axis_table(self.funnel, self.gains)

    @property
    def axes(self) -> int:
        """Number of axes m."""
        return int(self.funnel.goal_lower.size)


def axis_laws(plan: Plan, axes: Sequence[int]) -> tuple[AxisLaw, ...]:
    """Return the laws of some axes in every cell of a plan.

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
    return tuple(
        AxisLaw(plan.funnel(index).select(chosen), transition.gains.select(chosen))
        for index, transition in enumerate(plan.transitions)
    )
