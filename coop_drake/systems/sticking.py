"""Blocked wheels and the friction of joints as a block."""

from __future__ import annotations

from functools import partial

import numpy as np
from pydrake.systems.framework import BasicVector, Context

from coop_drake.laws.sticking import stick, sticking_room
from coop_drake.laws.team_dynamics import team_work
from coop_drake.plant.team_tree import TeamTree
from coop_drake.systems.block import Block
from coop_drake.tree.pose import FloatArray, IntArray


class Sticking(Block):
    """Adds what the floor does to bases with blocked wheels, and the friction of joints.

    See ``laws/sticking.py``. It is part of the world, not of a robot.

    ======= ================= ========== ==================================================== =====
    input   ``team_state``    2 (3 + n)  the plant's positions and velocities, its own order
    input   ``joint_torques`` n          torques of all joints in the order of q [N m or N]
    input   ``asked``         3 N or 3   wrenches on all bases without the floor's, and where  W
                              more       there are pushes, the one on the object [N, N m]
    output  ``forces``        as asked,  the same with the floor's; then the friction of every W
                              and 3 + n  joint at the place of its rate in the plant
    ======= ================= ========== ==================================================== =====

    No state.

    Args:
        whole: The team's plant in the plane.
        rates: Where the rates of the joints stand among those of the plant, in the order of q, shape (n,).
        times: Begin and end of the time in which the wheels of every base are blocked, shape (2, N) [s].
        friction: Coulomb friction of every joint [N m or N], and viscous friction [N m s or N s/m].
        gravity: Acceleration of gravity along x of W [m/s^2].
        size: Number of the wrenches' components.
    """

    def __init__(
        self, whole: TeamTree, rates: IntArray, times: FloatArray, friction: tuple[float, float],
        gravity: float, size: int,
    ) -> None:  # fmt: skip
        super().__init__()
        links, robots, rows = len(whole.tree), times.shape[1], size // 3
        self._rates, self._times, self._strongest = rates, times, whole.strongest
        work, room = team_work(whole.tree), sticking_room(links, robots)
        self._given, self._efforts = np.zeros(links + 2), np.zeros(links + 2)
        self._accelerations, self._wrenches = np.empty(links + 2), np.empty((rows, 3))
        known = whole.tree, whole.bases[:rows].copy(), whole.places[:rows].copy()
        self._stick = partial(stick, *known)
        self._rest, self._friction = (gravity, work, room), np.array(friction)
        self._state = self.DeclareVectorInputPort("team_state", 2 * (links + 2))
        self._torques = self.DeclareVectorInputPort("joint_torques", len(rates))
        self._asked = self.DeclareVectorInputPort("asked", size)
        self.DeclareVectorOutputPort("forces", size + links + 2, self._write_forces)

    def _write_forces(self, context: Context, output: BasicVector) -> None:
        asked, time, given, efforts = (
            self._asked.Eval(context),
            context.get_time(),
            self._given,
            self._efforts,
        )
        blocked = ((self._times[0] <= time) & (time < self._times[1])).astype(float)
        if not (blocked.any() or self._friction.any()):
            output.SetFromVector(np.concatenate([asked, np.zeros(given.size)]))
            return
        gravity, work, room = self._rest
        if len(self._rates):
            torques = self._torques.Eval(context)
            given[self._rates] = np.clip(torques, -self._strongest, self._strongest)
        efforts[:], self._wrenches[:] = given, asked.reshape(-1, 3)
        state, accelerations = self._state.Eval(context), self._accelerations
        self._stick(
            blocked, self._friction, efforts, gravity, state, work, room, accelerations, self._wrenches
        )
        output.SetFromVector(np.concatenate([self._wrenches.ravel(), efforts - given]))
