"""What one robot's end effector shall do: its share of the wrench on the object, and its acceleration."""

from __future__ import annotations

from functools import partial

import numpy as np
from pydrake.systems.framework import BasicVector, Context

from coop_drake.laws.load_sharing import end_effector_command
from coop_drake.systems.block import Block
from coop_drake.tree.pose import FloatArray


class WrenchLaw(Block):
    """Turns the object's desired acceleration into one robot's share of the load: (21), (28) and (31).

    ======= ======================= ===== ====================================================== =====
    input   ``object_state``        6     pose and twist of L                                    W
    input   ``governor_command``    4     rate of p_G, not used here; desired acceleration of    W
                                          L's origin [m/s^2]
    input   ``axis_acceleration``   1 + n desired angular acceleration [rad/s^2]; those of the   W
                                          joints, not used here
    output  ``object_acceleration`` 3     the desired accelerations of L [m/s^2, rad/s^2]         W
    output  ``hand_command``        6     acceleration of Ek that goes with it [m/s^2, rad/s^2], W
                                          then the wrench on the object at Ek [N, N m]
    ======= ======================= ===== ====================================================== =====

    No state.

    Args:
        p_LE: The grasp in L, shape (2,) [m].
        p_LLcm: The object's centre of mass in L, shape (2,) [m].
        mass: M_L [kg].
        inertia: I_L about the centre of mass [kg m^2].
        share: The robot's share of the load, in [0, 1]; the team's shares sum to one.
        joints: Number of the robot's joints n.

    Raises:
        ValueError: Mass or inertia is not positive, or the share is not in [0, 1].
    """

    def __init__(
        self, p_LE: FloatArray, *, p_LLcm: FloatArray, mass: float, inertia: float, share: float, joints: int
    ) -> None:
        super().__init__()
        if not (mass > 0.0 and inertia > 0.0):
            raise ValueError(f"WrenchLaw needs positive mass and inertia, not {mass} and {inertia}")
        if not 0.0 <= share <= 1.0:
            raise ValueError(f"WrenchLaw's share must lie in [0, 1], not {share}")
        load = np.array([*p_LE, *p_LLcm, mass, inertia, share], dtype=float)
        self._command = partial(end_effector_command, load)
        self._object = self.DeclareVectorInputPort("object_state", 6)
        self._governor = self.DeclareVectorInputPort("governor_command", 4)
        self._axes = self.DeclareVectorInputPort("axis_acceleration", 1 + joints)
        self.DeclareVectorOutputPort("object_acceleration", 3, self._write_object)
        self.DeclareVectorOutputPort("hand_command", 6, self._write_hand)

    def _write_object(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([*self._governor.Eval(context)[2:], self._axes.Eval(context)[0]])

    def _write_hand(self, context: Context, output: BasicVector) -> None:
        state, governor, axes = (
            self._object.Eval(context),
            self._governor.Eval(context),
            self._axes.Eval(context),
        )
        self._command(state, governor[2:], axes, output.get_mutable_value())
