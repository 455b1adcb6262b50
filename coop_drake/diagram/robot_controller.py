"""One robot's sub-Diagram: all that it computes, from what it alone knows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder, LeafSystem
from pydrake.systems.primitives import DiscreteTimeIntegrator, Integrator

from coop_drake.geometry.pose import PlanarPose
from coop_drake.planning.plan import Plan
from coop_drake.plant import ObjectInertia, RobotPlant
from coop_drake.systems import (
    GovernedCell,
    JointPpc,
    ObjectEstimator,
    OrientationPpc,
    ReadyMonitor,
    ReferenceGovernor,
    RobotEffort,
    WrenchLaw,
    axis_laws,
)

__all__ = ["TELEMETRY", "RobotKnowledge", "build_robot_controller"]

TELEMETRY = {
    "object_state": "object_estimator",
    "governor_position": "governor_state",
    "energy_margin": "reference_governor",
    "angle_funnel": "orientation_ppc",
    "joint_funnels": "joint_ppc",
    "object_acceleration": "wrench_law",
    "hand_command": "wrench_law",
}
"""Outputs that are exported to be looked at, by the log or a user, and the blocks that make them."""


@dataclass(frozen=True)
class RobotKnowledge:
    """What one robot is given before the run (Assumptions 1 and 3).

    Attributes:
        robot: Its model of itself.
        X_LE: Its grasp in L.
        joints: Where its joints stand in q.
        object_inertia: Mass properties of the object.
        load_share: Its part of the work, in [0, 1].
        plan: The plan.
        cells: What the governor needs of every cell.
        position_tolerance: How close to the goal counts as arrived [m].
        period: Time between two computations [s]; None for continuous time.
    """

    robot: RobotPlant
    X_LE: PlanarPose
    joints: slice
    object_inertia: ObjectInertia
    load_share: float
    plan: Plan
    cells: Sequence[GovernedCell]
    position_tolerance: float
    period: float | None = None


def build_robot_controller(knowledge: RobotKnowledge) -> Diagram:
    """Wire one robot's controller.

    ======= ===================== =========== ==========================================================
    input   ``robot_state``       2 (3 + n)   its own state (z_k, z_k')
    input   ``object_pose``       3           the object's measured pose
    input   ``current_cell``      2           (index, entry time), told by the cell planner
    output  ``robot_effort``      3 + n       its base wrench and joint torques
    output  ``ready``             2           (index, margin), told to the cell planner
    output  see ``TELEMETRY``                 to be looked at, by no other robot
    ======= ===================== =========== ==========================================================

    Args:
        knowledge: What the robot is given before the run.
    """
    builder = DiagramBuilder()
    blocks = {name: builder.AddNamedSystem(name, block) for name, block in _blocks(knowledge).items()}
    _connect_by_name(builder, blocks)
    builder.ExportOutput(blocks["robot_effort"].GetOutputPort("robot_effort"), "robot_effort")
    builder.ExportOutput(blocks["ready_monitor"].GetOutputPort("ready"), "ready")
    for output, block in TELEMETRY.items():
        port = (
            blocks[block].get_output_port()
            if block == "governor_state"
            else blocks[block].GetOutputPort(output)
        )
        builder.ExportOutput(port, output)
    return builder.Build()


def _blocks(knowledge: RobotKnowledge) -> dict[str, LeafSystem]:
    plan, cells, inertia = knowledge.plan, knowledge.cells, knowledge.object_inertia
    p_LE = np.array([knowledge.X_LE.x, knowledge.X_LE.y])
    joint_axes = [1 + i for i in range(knowledge.joints.start, knowledge.joints.stop)]
    return {
        "object_estimator": ObjectEstimator(knowledge.robot, p_LE),
        "reference_governor": ReferenceGovernor(cells),
        "governor_state": _governor_state(knowledge),
        "orientation_ppc": OrientationPpc(axis_laws(plan, [0])),
        "joint_ppc": JointPpc(axis_laws(plan, joint_axes)),
        "wrench_law": WrenchLaw(
            p_LE,
            p_LLcm=inertia.p_LLcm,
            mass=inertia.mass,
            inertia=inertia.inertia_about_com,
            share=knowledge.load_share,
        ),
        "robot_effort": RobotEffort(knowledge.robot),
        "ready_monitor": ReadyMonitor(
            cells,
            axis_laws(plan, [0, *joint_axes]),
            [transition.inradius for transition in plan.transitions],
            plan.goal_pose[:2],
            knowledge.position_tolerance,
        ),
    }


def _governor_state(knowledge: RobotKnowledge) -> Integrator | DiscreteTimeIntegrator:
    """Keeps p_G; the discrete one is set to the start when a context is made."""
    if knowledge.period is None:
        return Integrator(knowledge.plan.start[:2])
    return DiscreteTimeIntegrator(2, knowledge.period)


def _connect_by_name(builder: DiagramBuilder, blocks: Mapping[str, LeafSystem]) -> None:
    """Join every input to the output of its name; inputs that no block makes come from outside."""
    governor = blocks["governor_state"]
    sources = {"governor_position": governor.get_output_port()}
    for name, block in blocks.items():
        if name != "governor_state":
            for i in range(block.num_output_ports()):
                sources[block.get_output_port(i).get_name()] = block.get_output_port(i)
    builder.Connect(sources["governor_velocity"], governor.get_input_port())
    outside: set[str] = set()
    for name, block in blocks.items():
        for port in (block.get_input_port(i) for i in range(block.num_input_ports())):
            if name == "governor_state":
                continue
            if port.get_name() in sources:
                builder.Connect(sources[port.get_name()], port)
            elif port.get_name() in outside:
                builder.ConnectInput(port.get_name(), port)
            else:
                builder.ExportInput(port, port.get_name())
                outside.add(port.get_name())
