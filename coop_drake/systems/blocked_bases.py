"""The wrenches of the floor on bases whose wheels are blocked, as a block."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context

from coop_drake.compiled import prepared
from coop_drake.laws.blocked_wheels import blocked_room, hold_blocked
from coop_drake.laws.team_dynamics import team_work
from coop_drake.plant.team_tree import TeamTree
from coop_drake.systems.block import VECTOR, Block
from coop_drake.tree.pose import FloatArray, IntArray


class BlockedBases(Block):
    """Adds what the floor does to bases with blocked wheels, see ``laws/blocked_wheels.py``.

    It is part of the world, not of a robot.

    ======= ================= ========== ==================================================== =====
    input   ``team_state``    2 (3 + n)  the plant's positions and velocities, its own order
    input   ``joint_torques`` n          torques of all joints in the order of q [N m or N]
    input   ``asked``         3 N or 3   wrenches on all bases without the floor's, and where  W
                              more       there are pushes, the one on the object [N, N m]
    output  ``held``          as asked   the same with the floor's                             W
    ======= ================= ========== ==================================================== =====

    No state.

    Args:
        whole: The team's plant in the plane.
        rates: Where the rates of the joints stand among those of the plant, in the order of q, shape (n,).
        times: Begin and end of the time in which the wheels of every base are blocked, shape (2, N) [s].
        gravity: Acceleration of gravity along x of W [m/s^2].
        size: Number of the wrenches' components.
    """

    def __init__(
        self, whole: TeamTree, rates: IntArray, times: FloatArray, gravity: float, size: int
    ) -> None:
        super().__init__()
        links, robots, rows = len(whole.tree), times.shape[1], size // 3
        self._rates, self._times, self._strongest = rates, times, whole.strongest
        work, room = team_work(whole.tree), blocked_room(links, robots)
        self._efforts, self._accelerations = np.zeros(links + 2), np.empty(links + 2)
        self._wrenches = np.empty((rows, 3))
        known = whole.tree, whole.bases[:rows].copy(), whole.places[:rows].copy()
        self._hold = prepared(
            hold_blocked, known, VECTOR, VECTOR, 0.0, VECTOR, work, room, VECTOR, self._wrenches
        )
        self._rest = gravity, work, room
        self._state = self.DeclareVectorInputPort("team_state", 2 * (links + 2))
        self._torques = self.DeclareVectorInputPort("joint_torques", len(rates))
        self._asked = self.DeclareVectorInputPort("asked", size)
        self.DeclareVectorOutputPort("held", size, self._write_held)

    def _write_held(self, context: Context, output: BasicVector) -> None:
        asked, time = self._asked.Eval(context), context.get_time()
        blocked = ((self._times[0] <= time) & (time < self._times[1])).astype(float)
        if not blocked.any():
            output.SetFromVector(asked)
            return
        gravity, work, room = self._rest
        if len(self._rates):
            torques = self._torques.Eval(context)
            self._efforts[self._rates] = np.clip(torques, -self._strongest, self._strongest)
        self._wrenches[:] = asked.reshape(-1, 3)
        state = self._state.Eval(context)
        self._hold(blocked, self._efforts, gravity, state, work, room, self._accelerations, self._wrenches)
        output.SetFromVector(self._wrenches.ravel())
