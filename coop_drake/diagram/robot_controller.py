"""One robot's sub-Diagram: all that it computes, from what it knows and measures itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder, LeafSystem, OutputPort
from pydrake.systems.primitives import Demultiplexer, DiscreteTimeIntegrator, Integrator, ZeroOrderHold

from coop_drake.answers.plan import Plan
from coop_drake.plant import ObjectInertia, RobotPlant
from coop_drake.systems import (
    AxisPpc,
    GovernedCell,
    ObjectEstimator,
    ReadyMonitor,
    ReferenceGovernor,
    RobotEffort,
    WrenchLaw,
    axis_laws,
)
from coop_drake.tree.pose import PlanarPose

__all__ = ["TELEMETRY", "Replacements", "RobotKnowledge", "build_robot_controller"]

TELEMETRY = (
    "object_state",
    "governor_position",
    "energy_margin",
    "funnels",
    "object_acceleration",
    "hand_command",
)
"""Outputs of blocks that are exported for the log and for users."""


@dataclass(frozen=True)
class RobotKnowledge:
    """What one robot is given before the run (Assumptions 1 and 3).

    Attributes:
        robot: Its model of itself.
        X_LE: Its grasp in L.
        joints: Where its joints stand in q.
        object_inertia: Mass properties of the object.
        load_share: Its share of the load, in [0, 1].
        plan: The plan.
        cells: What the governor needs of every cell.
        position_tolerance: How close to the goal counts as arrived [m].
        period: Time between two computations [s]; None for continuous time.
        sample_offset: Time of the first computation [s].
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
    sample_offset: float = 0.0


Replacements = Mapping[str, Callable[[RobotKnowledge], LeafSystem]]
"""Blocks of a user's own: the name of the block that each replaces, and what builds it for a robot."""


def build_robot_controller(knowledge: RobotKnowledge, replacements: Replacements | None = None) -> Diagram:
    """Build one robot's controller.

    ======= ===================== =========== ==========================================================
    input   ``robot_state``       2 (3 + n)   its own state (z_k, z_k')
    input   ``object_pose``       3           the object's measured pose
    input   ``current_cell``      2           (index, entry time), from the cell planner
    output  ``robot_effort``      3 + n       its base wrench and joint torques
    output  ``ready``             2           (index, margin), for the cell planner
    output  see ``TELEMETRY``                 for the log and for users, not for other robots
    ======= ===================== =========== ==========================================================

    Args:
        knowledge: What the robot is given before the run.
        replacements: Blocks in place of those of the same name; their ports must have the same names.

    Raises:
        ValueError: No block has a name among the replacements.
    """
    builder, own = DiagramBuilder(), _blocks(knowledge)
    for name, build in (replacements or {}).items():
        if name not in own:
            raise ValueError(f"replacements: {name!r} is not allowed; expected one of {', '.join(own)}")
        own[name] = build(knowledge)
    blocks = {name: builder.AddNamedSystem(name, block) for name, block in own.items()}
    outputs = {
        port.get_name(): port
        for block in blocks.values()
        for port in (block.get_output_port(i) for i in range(block.num_output_ports()))
    }
    command = outputs["governor_command"]
    outputs["governor_position"] = _add_governor_state(builder, knowledge, command)
    _connect_by_name(builder, blocks, outputs)
    for name in ("robot_effort", "ready", *TELEMETRY):
        builder.ExportOutput(outputs[name], name)
    return builder.Build()


def _blocks(knowledge: RobotKnowledge) -> dict[str, LeafSystem]:
    plan, cells, inertia = knowledge.plan, knowledge.cells, knowledge.object_inertia
    p_LE = np.array([knowledge.X_LE.x, knowledge.X_LE.y])
    joints = range(knowledge.joints.start, knowledge.joints.stop)
    laws = axis_laws(plan, [0, *(1 + i for i in joints)])
    return {
        "object_estimator": ObjectEstimator(knowledge.robot, p_LE),
        "reference_governor": ReferenceGovernor(cells),
        "axis_ppc": AxisPpc(laws),
        "wrench_law": WrenchLaw(
            p_LE,
            p_LLcm=inertia.p_LLcm,
            mass=inertia.mass,
            inertia=inertia.inertia_about_com,
            share=knowledge.load_share,
            joints=len(joints),
        ),
        "robot_effort": RobotEffort(knowledge.robot),
        "ready_monitor": ReadyMonitor(
            cells,
            laws,
            [transition.inradius for transition in plan.transitions],
            plan.goal_pose[:2],
            knowledge.position_tolerance,
        ),
    }


def _add_governor_state(
    builder: DiagramBuilder, knowledge: RobotKnowledge, command: OutputPort
) -> OutputPort:
    """Add the integrator of p_G, whose rate is the first half of the governor's command.

    Its initial value is set when a context is made, if it is a discrete one. Drake's discrete integrator has
    no offset; one in continuous time has the same values at the samples of a rate that is held in between.
    """
    halves = builder.AddNamedSystem("governor_rate", Demultiplexer([2, 2]))
    builder.Connect(command, halves.get_input_port())
    rate, period, offset = halves.get_output_port(0), knowledge.period, knowledge.sample_offset
    if period is not None and offset > 0.0:
        hold = builder.AddNamedSystem("governor_rate_hold", ZeroOrderHold(period, 2, offset))
        builder.Connect(rate, hold.get_input_port())
        rate = hold.get_output_port()
    discrete = period is not None and offset == 0.0
    integrator = DiscreteTimeIntegrator(2, period) if discrete else Integrator(knowledge.plan.start[:2])
    state = builder.AddNamedSystem("governor_state", integrator)
    builder.Connect(rate, state.get_input_port())
    return state.get_output_port()


def _connect_by_name(
    builder: DiagramBuilder, blocks: Mapping[str, LeafSystem], outputs: Mapping[str, OutputPort]
) -> None:
    """Connect every input to the output of the same name; export inputs that no block computes."""
    outside: set[str] = set()
    for block in blocks.values():
        for port in (block.get_input_port(i) for i in range(block.num_input_ports())):
            name = port.get_name()
            if name in outputs:
                builder.Connect(outputs[name], port)
            elif name in outside:
                builder.ConnectInput(name, port)
            else:
                builder.ExportInput(port, name)
                outside.add(name)
