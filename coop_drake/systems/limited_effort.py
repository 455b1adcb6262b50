"""Actuators that give no more than they can."""

from __future__ import annotations

from functools import partial

from pydrake.systems.framework import BasicVector, Context

from coop_drake.laws.actuators import limit_efforts
from coop_drake.systems.block import Block
from coop_drake.tree.pose import FloatArray


class LimitedEffort(Block):
    """Cuts the efforts of one robot to its limits: the base's force by its length, all others one by one.

    ======= ========== ===== ===================================================================
    input   ``asked``  3 + n base wrench and joint torques that are asked for [N, N m]
    output  ``given``  3 + n those that the actuators give [N, N m]
    ======= ========== ===== ===================================================================

    No state.

    Args:
        limits: Largest force and torque of the base, and efforts of the joints, shape (2 + n,) [N, N m].

    Raises:
        ValueError: A limit is not positive.
    """

    def __init__(self, limits: FloatArray) -> None:
        super().__init__()
        if not (limits > 0.0).all():
            raise ValueError(f"LimitedEffort needs positive limits, not {limits.tolist()}")
        self._limit, size = partial(limit_efforts, limits), limits.size + 1
        self._asked = self.DeclareVectorInputPort("asked", size)
        self.DeclareVectorOutputPort("given", size, self._write_given)

    def _write_given(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._asked.Eval(context))
        self._limit(output.get_mutable_value())
