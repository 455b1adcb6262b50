"""What one robot's hand shall do to the object: its share of the wrench, and the grasp's acceleration."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from coop_drake.control.load_sharing import acceleration_at, rotate, wrench_share
from coop_drake.geometry.pose import FloatArray

__all__ = ["WrenchLaw"]


class WrenchLaw(LeafSystem):
    """Turns the object's desired acceleration into one robot's share of the work: (21), (28) and (31).

    ======= ============================ ==== ====================================================== =====
    input   ``object_pose``              3    pose of L in W [m, rad]                                W
    input   ``object_twist``             3    velocity of L's origin, angular rate [m/s, rad/s]      W
    input   ``position_acceleration``    2    desired acceleration of L's origin [m/s^2]             W
    input   ``angle_acceleration``       1    desired angular acceleration [rad/s^2]                 W
    output  ``object_acceleration``      3    both in one [m/s^2, rad/s^2]                           W
    output  ``grasp_acceleration``       3    acceleration of Ek that goes with it [m/s^2, rad/s^2]  W
    output  ``wrench_share``             3    wrench on the object at Ek [N, N m]                    W
    ======= ============================ ==== ====================================================== =====

    No state.

    Args:
        p_LE: The grasp in L, shape (2,) [m].
        p_LLcm: The object's centre of mass in L, shape (2,) [m].
        mass: M_L [kg].
        inertia: I_L about the centre of mass [kg m^2].
        robots: Number of robots that share the wrench.

    Raises:
        ValueError: Mass, inertia or the number of robots is not positive.
    """

    def __init__(
        self, p_LE: FloatArray, *, p_LLcm: FloatArray, mass: float, inertia: float, robots: int
    ) -> None:
        super().__init__()
        if not (mass > 0.0 and inertia > 0.0 and robots > 0):
            raise ValueError(
                f"WrenchLaw needs positive mass, inertia and robots, not {mass}, {inertia} and {robots}"
            )
        self._p_LE, self._p_LLcm = np.array(p_LE, dtype=float), np.array(p_LLcm, dtype=float)
        self._mass, self._inertia, self._robots = mass, inertia, robots
        self._pose = self.DeclareVectorInputPort("object_pose", 3)
        self._twist = self.DeclareVectorInputPort("object_twist", 3)
        self._linear = self.DeclareVectorInputPort("position_acceleration", 2)
        self._angular = self.DeclareVectorInputPort("angle_acceleration", 1)
        self._command = self.DeclareVectorOutputPort("object_acceleration", 3, self._write_command)
        self.DeclareVectorOutputPort("grasp_acceleration", 3, self._write_grasp)
        self.DeclareVectorOutputPort("wrench_share", 3, self._write_share)

    def _write_command(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(np.concatenate([self._linear.Eval(context), self._angular.Eval(context)]))

    def _write_grasp(self, context: Context, output: BasicVector) -> None:
        theta, rate = self._pose.Eval(context)[2], self._twist.Eval(context)[2]
        output.SetFromVector(acceleration_at(self._command.Eval(context), rate, rotate(theta, self._p_LE)))

    def _write_share(self, context: Context, output: BasicVector) -> None:
        theta, rate = self._pose.Eval(context)[2], self._twist.Eval(context)[2]
        output.SetFromVector(
            wrench_share(
                self._command.Eval(context),
                rate,
                rotate(theta, self._p_LE),
                com_offset=rotate(theta, self._p_LLcm),
                mass=self._mass,
                inertia=self._inertia,
                robots=self._robots,
            )
        )
