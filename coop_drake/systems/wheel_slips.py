"""What reaches the floor of the wrenches of bases whose wheels slip, as a block."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context

from coop_drake.systems.block import Block
from coop_drake.tree.pose import FloatArray


class WheelSlips(Block):
    """Takes a share off the wrenches of bases while their wheels slip; part of the world, not of a robot.

    ======= ========== ==== ============================================== =====
    input   ``driven`` 3 N  wrenches that the actuators of all bases give  W
    output  ``passed`` 3 N  what the floor takes up of them [N, N m]       W
    ======= ========== ==== ============================================== =====

    No state.

    Args:
        slips: When the wheels of every base slip from and until [s], and the share that is lost then [-],
            shape (3, N).
    """

    def __init__(self, slips: FloatArray) -> None:
        super().__init__()
        self._slips = slips
        self._driven = self.DeclareVectorInputPort("driven", 3 * slips.shape[1])
        self.DeclareVectorOutputPort("passed", 3 * slips.shape[1], self._write_passed)

    def _write_passed(self, context: Context, output: BasicVector) -> None:
        time, (begin, end, share) = context.get_time(), self._slips
        left = np.where((begin <= time) & (time < end), 1.0 - share, 1.0)
        output.SetFromVector(np.repeat(left, 3) * self._driven.Eval(context))
