"""What one robot's hand shall do to the object: its share of the wrench, and the grasp's acceleration."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context

from coop_drake.control.kernels import hand_command
from coop_drake.geometry.pose import FloatArray
from coop_drake.systems.block import Block

__all__ = ["WrenchLaw"]


class WrenchLaw(Block):
    """Turns the object's desired acceleration into one robot's share of the work: (21), (28) and (31).

    ======= ========================== ==== ====================================================== =====
    input   ``object_state``           6    pose and twist of L                                    W
    input   ``position_acceleration``  2    desired acceleration of L's origin [m/s^2]             W
    input   ``angle_acceleration``     1    desired angular acceleration [rad/s^2]                 W
    output  ``object_acceleration``    3    both in one [m/s^2, rad/s^2]                           W
    output  ``hand_command``           6    acceleration of Ek that goes with it [m/s^2, rad/s^2],
                                            then the wrench on the object at Ek [N, N m]           W
    ======= ========================== ==== ====================================================== =====

    No state.

    Args:
        p_LE: The grasp in L, shape (2,) [m].
        p_LLcm: The object's centre of mass in L, shape (2,) [m].
        mass: M_L [kg].
        inertia: I_L about the centre of mass [kg m^2].
        share: The robot's part of the work, in [0, 1]; the team's sum to one.

    Raises:
        ValueError: Mass or inertia is not positive, or the share is not in [0, 1].
    """

    def __init__(
        self, p_LE: FloatArray, *, p_LLcm: FloatArray, mass: float, inertia: float, share: float
    ) -> None:
        super().__init__()
        if not (mass > 0.0 and inertia > 0.0):
            raise ValueError(f"WrenchLaw needs positive mass and inertia, not {mass} and {inertia}")
        if not 0.0 <= share <= 1.0:
            raise ValueError(f"WrenchLaw's share must lie in [0, 1], not {share}")
        self._parameters = np.array([*p_LE, *p_LLcm, mass, inertia, share], dtype=float)
        self._object = self.DeclareVectorInputPort("object_state", 6)
        self._linear = self.DeclareVectorInputPort("position_acceleration", 2)
        self._angular = self.DeclareVectorInputPort("angle_acceleration", 1)
        self.DeclareVectorOutputPort("object_acceleration", 3, self._write_object)
        self.DeclareVectorOutputPort("hand_command", 6, self._write_hand)

    def _write_object(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([*self._linear.Eval(context), *self._angular.Eval(context)])

    def _write_hand(self, context: Context, output: BasicVector) -> None:
        hand_command(
            self._parameters,
            self._object.Eval(context),
            self._linear.Eval(context),
            self._angular.Eval(context),
            output.get_mutable_value(),
        )
