"""One robot's sub-Diagram: all that it computes, from what it knows and measures itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder, LeafSystem, OutputPort
from pydrake.systems.primitives import Demultiplexer, DiscreteTimeIntegrator, Integrator, ZeroOrderHold

from coop_drake import systems
from coop_drake.answers.plan import Plan
from coop_drake.laws.readiness import ArrivalGoal
from coop_drake.plant import ObjectInertia, RobotPlant
from coop_drake.scenario import Hold
from coop_drake.tree.pose import FloatArray, PlanarPose

TELEMETRY = (
    "object_state",
    "governor_position",
    "energy_margin",
    "funnels",
    "object_acceleration",
    "hand_command",
)
"""Outputs of blocks that are exported for the log and for users."""

HELD = ("hold_request", "clock")
"""Outputs of a robot whose team may be held."""


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
        predicted_periods: Age of its measurements that it predicts over, in control periods; 0 for none.
        hold: When the team is held, None for never.
        observer_gains: Gain and leak of its disturbance observer [1/s]; None for no observer.
        goal: What it compares the means of what it measures with, where it is sampled.
        motion: The nominal motion of the position; None where p_G follows the measured position.
        axis_motion: That of the object's angle and of its joints; None where their law acts on what is
            measured.
        monitored: What its monitor of departures needs; None where there is no nominal motion.
        measured_age: Age of its measurements, in whole periods [s].
    """

    robot: RobotPlant
    X_LE: PlanarPose
    joints: slice
    object_inertia: ObjectInertia
    load_share: float
    plan: Plan
    cells: Sequence[systems.GovernedCell]
    position_tolerance: float
    goal: ArrivalGoal
    period: float | None = None
    sample_offset: float = 0.0
    predicted_periods: int = 0
    observer_gains: tuple[float, float] | None = None
    hold: Hold | None = None
    motion: systems.NominalMotion | None = None
    axis_motion: systems.AxisMotion | None = None
    monitored: systems.MonitoredRobot | None = None
    measured_age: float = 0.0

    @property
    def p_LE(self) -> FloatArray:
        """The grasp in L, shape (2,) [m]."""
        return np.array([self.X_LE.x, self.X_LE.y])

    @property
    def load(self) -> FloatArray:
        """The robot's load, as ``end_effector_command`` takes it, shape (7,)."""
        inertia = self.object_inertia
        mass = inertia.mass, inertia.inertia_about_com
        return np.array([*self.p_LE, *inertia.p_LLcm, *mass, self.load_share])


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
    input   ``hold_message``      2           from the hold supervisor, only where the team may be held
    output  ``hold_request``      2           to the hold supervisor, only where the team may be held
    output  ``alarm``             3           of its monitor of departures, for itself and the log, only where
                                              the plan has a budget
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
    if knowledge.motion is None:
        halves = builder.AddNamedSystem("governor_rate", Demultiplexer([2, 2]))
        builder.Connect(outputs["governor_command"], halves.get_input_port())
        start, rate = knowledge.plan.start[:2], halves.get_output_port(0)
        outputs["governor_position"] = _integrated(builder, knowledge, "governor_state", rate, start)
    if "disturbance_observer" in blocks:
        rate = outputs["observer_rate"]
        at_rest = np.zeros(rate.size())
        outputs["observed_rates"] = _integrated(builder, knowledge, "observer_state", rate, at_rest)
    _connect_by_name(builder, blocks, outputs)
    held = HELD if knowledge.hold is not None else ()
    alarm = () if knowledge.monitored is None else ("alarm",)
    for name in ("robot_effort", "ready", *TELEMETRY, *held, *alarm):
        builder.ExportOutput(outputs[name], name)
    return builder.Build()


def _blocks(knowledge: RobotKnowledge) -> dict[str, LeafSystem]:
    plan, cells, inertia, p_LE = knowledge.plan, knowledge.cells, knowledge.object_inertia, knowledge.p_LE
    joints = range(knowledge.joints.start, knowledge.joints.stop)
    axes = [0, *(1 + i for i in joints)]
    laws, paced = systems.axis_laws(plan, axes), knowledge.hold is not None
    return {
        "object_estimator": systems.ObjectEstimator(knowledge.robot, p_LE),
        **_governor(knowledge, paced=paced),
        "axis_ppc": systems.AxisPpc(
            laws,
            start=plan.start[2:][np.array(axes)],
            period=knowledge.period,
            offset=knowledge.sample_offset,
            paced=paced,
        ),
        "wrench_law": systems.WrenchLaw(
            p_LE,
            p_LLcm=inertia.p_LLcm,
            mass=inertia.mass,
            inertia=inertia.inertia_about_com,
            share=knowledge.load_share,
            joints=len(joints),
        ),
        "robot_effort": systems.RobotEffort(knowledge.robot),
        "ready_monitor": systems.ReadyMonitor(
            cells,
            laws,
            [transition.inradius for transition in plan.transitions],
            plan.goal_pose[:2],
            knowledge.position_tolerance,
            nominal=knowledge.motion is not None,
            measured=knowledge.period is not None,
            axes_led=knowledge.axis_motion is not None,
        ),
        **_additions(knowledge, laws),
    }


def _governor(knowledge: RobotKnowledge, *, paced: bool) -> dict[str, LeafSystem]:
    """Return the block that moves p_G: by the measured position, or by the nominal one."""
    if knowledge.motion is None:
        return {"reference_governor": systems.ReferenceGovernor(knowledge.cells, paced=paced)}
    return {"nominal_governor": systems.NominalGovernor(knowledge.cells, knowledge.motion, paced=paced)}


def _additions(knowledge: RobotKnowledge, laws: Sequence[systems.AxisLaw]) -> dict[str, LeafSystem]:
    """Return the blocks that sampling, a budget and a scenario's section ``control`` add."""
    added: dict[str, LeafSystem] = {}
    if knowledge.period is not None:
        added["arrival_monitor"] = systems.ArrivalMonitor(
            knowledge.goal, len(knowledge.cells), knowledge.period, knowledge.sample_offset
        )
    if knowledge.predicted_periods and knowledge.period is not None:
        added["state_predictor"] = systems.StatePredictor(
            knowledge.robot,
            knowledge.load,
            knowledge.predicted_periods,
            knowledge.period,
            offset=knowledge.sample_offset,
        )
    if knowledge.axis_motion is not None:
        added["nominal_axes"] = systems.NominalAxes(knowledge.axis_motion)
    if knowledge.hold is not None:
        period, offset = knowledge.period, knowledge.sample_offset
        silence = knowledge.hold.silence
        added["hold_receiver"] = systems.HoldReceiver(silence, period=period, offset=offset)
        added["funnel_clock"] = systems.FunnelClock(period, offset)
        alarmed = knowledge.monitored is not None
        added["hold_monitor"] = systems.HoldMonitor(
            laws, knowledge.hold.energy, alarmed=alarmed, period=period, offset=offset
        )
    if knowledge.monitored is not None:
        added["departure_monitor"] = systems.DepartureMonitor(knowledge.monitored)
    if knowledge.observer_gains is not None:
        joints = knowledge.joints.stop - knowledge.joints.start
        added["disturbance_observer"] = systems.DisturbanceObserver(joints, *knowledge.observer_gains)
    return added


def _integrated(
    builder: DiagramBuilder, knowledge: RobotKnowledge, name: str, rate: OutputPort, initial: FloatArray
) -> OutputPort:
    """Add the integrator of a rate; a discrete one gets its initial value when a context is made.

    Drake's discrete integrator has no offset; one in continuous time has the same values at the samples of a
    rate that is held in between.
    """
    period, offset, size = knowledge.period, knowledge.sample_offset, rate.size()
    if period is not None and offset > 0.0:
        hold = builder.AddNamedSystem(f"{name}_rate_hold", ZeroOrderHold(period, size, offset))
        builder.Connect(rate, hold.get_input_port())
        rate = hold.get_output_port()
    discrete = period is not None and offset == 0.0
    state = builder.AddNamedSystem(
        name, DiscreteTimeIntegrator(size, period) if discrete else Integrator(initial)
    )
    builder.Connect(rate, state.get_input_port())
    return state.get_output_port()


_REPLACED = {
    "state_predictor": {"robot_state": "predicted_state", "object_pose": "predicted_pose"},
    "disturbance_observer": {
        "governor_command": "compensated_command",
        "axis_acceleration": "compensated_axes",
    },
}
"""Which signals others get in place of those that a block takes in."""

_NOMINAL = {"object_state": "nominal_object", "robot_state": "nominal_robot"}
"""Signals that the blocks below get instead, where a plan has a nominal motion of the axes."""

_FOLLOWERS = ("axis_ppc", "ready_monitor")
"""Blocks that act on this nominal motion."""

_AHEAD = {"object_state": "object_ahead", "robot_state": "robot_ahead"}
"""Which signals the blocks that command get then: measured angles and rates would be late and noisy."""

_RAW = ("state_predictor", "departure_monitor", "arrival_monitor")
"""Blocks that get what was measured where others get a prediction."""

_COMPENSATED = ("wrench_law", "robot_effort")
"""Blocks that command; all others take the accelerations that the law wants."""


def _connect_by_name(
    builder: DiagramBuilder, blocks: Mapping[str, LeafSystem], outputs: Mapping[str, OutputPort]
) -> None:
    """Connect every input to the output of its name or to its replacement; export what no block computes."""
    outside: set[str] = set()
    for label, block in blocks.items():
        renamed: dict[str, str] = {}
        if "state_predictor" in blocks and label not in _RAW:
            renamed |= _REPLACED["state_predictor"]
        if "nominal_axes" in blocks and label != "nominal_axes":
            if label in _FOLLOWERS:
                renamed |= _NOMINAL
            else:
                renamed["axis_acceleration"] = "pulled_axes"
                renamed |= _AHEAD if label in _COMPENSATED else {}
        if "disturbance_observer" in blocks and label in _COMPENSATED:
            renamed |= _REPLACED["disturbance_observer"]
        for port in (block.get_input_port(i) for i in range(block.num_input_ports())):
            name = renamed.get(port.get_name(), port.get_name())
            if name in outputs:
                builder.Connect(outputs[name], port)
            elif name in outside:
                builder.ConnectInput(name, port)
            else:
                builder.ExportInput(port, name)
                outside.add(name)
