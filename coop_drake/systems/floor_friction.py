"""The friction of all bases on the floor as a block."""

from __future__ import annotations

from collections.abc import Sequence

from pydrake.systems.framework import BasicVector, Context

from coop_drake.laws.friction import base_friction
from coop_drake.systems.block import Block


class FloorFriction(Block):
    """Gives the friction force on every base, see ``laws/friction.py``; part of the world, not of a robot.

    ======= ===================== ========= ===================================================== =====
    input   ``robot_<k>_state``   2 (3+n_k) z_k and its rate, z_k = (x, y, yaw of Bk, q_k)         W
    output  ``friction_wrenches`` 3 N       force and zero torque on every base at Bk [N, N m]     W
    ======= ===================== ========= ===================================================== =====

    No state.

    Args:
        joints: Number of joints of every robot.
        coulomb: Coulomb friction of a base [N].
        viscous: Viscous friction of a base [N s/m].

    Raises:
        ValueError: A friction is negative.
    """

    def __init__(self, joints: Sequence[int], coulomb: float, viscous: float) -> None:
        super().__init__()
        if not (coulomb >= 0.0 and viscous >= 0.0):
            raise ValueError(f"FloorFriction needs no negative friction, not {coulomb} and {viscous}")
        self._friction = coulomb, viscous
        self._robots = [
            (self.DeclareVectorInputPort(f"robot_{k}_state", 2 * (3 + n)), 3 + n)
            for k, n in enumerate(joints)
        ]
        self.DeclareVectorOutputPort("friction_wrenches", 3 * len(joints), self._write_friction)

    def _write_friction(self, context: Context, output: BasicVector) -> None:
        wrenches = output.get_mutable_value()
        for k, (port, rates) in enumerate(self._robots):
            vx, vy = port.Eval(context)[rates : rates + 2]
            wrenches[3 * k], wrenches[3 * k + 1] = base_friction(vx, vy, *self._friction)
            wrenches[3 * k + 2] = 0.0
