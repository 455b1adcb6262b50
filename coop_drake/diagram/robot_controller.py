"""One robot: what it knows before a run, and the sub-Diagram of all that it computes in a run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import hypot, inf, pi

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder, LeafSystem, OutputPort
from pydrake.systems.primitives import Demultiplexer, DiscreteTimeIntegrator, Integrator, ZeroOrderHold

from coop_drake import systems
from coop_drake.answers.plan import Plan
from coop_drake.diagram.deployment import TELEMETRY, radio_of
from coop_drake.errors import PlanError, ScenarioError
from coop_drake.geometry.polygons import BoundaryDistance
from coop_drake.harmonic_maps import HarmonicMap, VelocityField
from coop_drake.laws.governor import FIELD_SPEED, slowdown_radius
from coop_drake.laws.measurements import observer_gains, whole_periods
from coop_drake.laws.readiness import ArrivalGoal
from coop_drake.laws.words import CLOCK_ERROR, ROUNDING, WORD_PERIOD, Schedule, schedule_of
from coop_drake.plant import ObjectInertia, RobotPlant, TeamPlant, base_chain, build_robot_plant, robot_chain
from coop_drake.plant.team import RobotModel
from coop_drake.robustness.tracking import moving_of, unknown_time
from coop_drake.scenario import Hold, Scenario
from coop_drake.systems import GovernedCell, MonitoredRobot
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import PlanarPose

HELD = ("hold_request", "clock")
"""Outputs of a robot whose team may be held."""

PASSES = ("said", "phase", "current_cell")
"""Outputs of a robot whose team passes from cell to cell."""


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
        monitored: What its monitor of departures needs; None without a budget.
        measured_age: Age of its measurements, in whole periods [s].
        schedule: Of the words of a team that passes from cell to cell; None for one that rests in them.
        radio: How it hears and speaks these.
        mounting: See ``place_on_axes``, shape (1 + n,).
        lag: Time constant of the actuators that it counts on [s].
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
    monitored: systems.MonitoredRobot | None = None
    measured_age: float = 0.0
    schedule: Schedule | None = None
    radio: systems.Radio | None = None
    mounting: FloatArray | None = None
    lag: float = 0.0

    @property
    def measurement_periods(self) -> int:
        """How many periods older than now what it uses is [-]."""
        if self.period is None or self.predicted_periods:
            return 0
        return whole_periods(self.measured_age, self.period)

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


# What every robot knows before a run, from scenario, plan and maps.


def robot_knowledge(
    scenario: Scenario, plan: Plan, maps: Sequence[HarmonicMap], team: TeamPlant
) -> list[RobotKnowledge]:
    """Return what each robot of a team knows before a run.

    Args:
        scenario: The scenario.
        plan: A plan for it.
        maps: The harmonic map of every transition; not read where the plan has a motion.
        team: The simulated team.

    Raises:
        PlanError: The plan belongs to another team, or the number of maps is not the number of cells.
        ScenarioError: Words may be later than the plan's motion allows.
    """
    _check(plan, maps, team)
    cells = governed_cells(plan, maps)
    factor, deployment, control = 1.0 + scenario.deployment.mass_error, scenario.deployment, scenario.control
    hold = hold_of(scenario, plan)
    delay = whole_periods(deployment.measurements.delay, deployment.period) if deployment.period else 0
    schedule, names = team_schedule(scenario, plan), [robot.name for robot in team.robots]
    return [
        RobotKnowledge(
            robot=_robot(scenario, robot.index, factor),
            X_LE=robot.X_LE,
            joints=robot.q_slice,
            object_inertia=team.object_inertia.scaled(factor),
            load_share=scenario.load_share(robot.name, len(team.robots)),
            plan=plan,
            cells=cells,
            position_tolerance=float(scenario.goal.tolerances.position),
            period=deployment.period,
            sample_offset=deployment.of_robot(robot.name).sample_offset,
            predicted_periods=delay if control.predictor else 0,
            hold=hold,
            goal=arrival_goal(scenario, plan, robot.q_slice),
            observer_gains=observer_gains(scenario.command_age) if control.observer else None,
            measured_age=deployment.whole_delay,
            monitored=_monitored(scenario, plan, team, robot),
            schedule=schedule,
            radio=None if schedule is None else radio_of(deployment, names, robot.index),
            mounting=base_chain(team, robot).mounting,
            lag=deployment.actuators.lag if plan.budget is None else plan.budget.lag,
        )
        for robot in team.robots
    ]


def team_schedule(scenario: Scenario, plan: Plan) -> Schedule | None:
    """Return the schedule of the words of a team that passes from cell to cell, None for one that rests.

    Raises:
        ScenarioError: Words may be later than the plan's motion allows.
        PlanError: The motion's cells make no schedule: two overlap too shortly for wrong clocks, for example.
    """
    motion, deployment = plan.motion, scenario.deployment
    if motion is None:
        return None
    period, eps = deployment.period or WORD_PERIOD, CLOCK_ERROR
    if plan.budget is not None:
        eps = plan.budget.clock_error
    delay = 0.5 * motion.waiting - 2.0 * eps - 2.0 * period
    if delay < -ROUNDING:
        allowed = f"at least {4.0 / (motion.waiting - 4.0 * eps):.6g} Hz, for words of the plan's motion"
        raise ScenarioError(str(scenario.path), "deployment.control_rate", deployment.control_rate, allowed)
    delay = max(delay, 0.0)
    if deployment.messages.delay > delay:
        allowed = f"at most {delay:.6g} s: the plan's motion waits no longer for words"
        raise ScenarioError(
            str(scenario.path), "deployment.messages.delay", deployment.messages.delay, allowed
        )
    begins, ends = motion.windows[:, 0], motion.windows[:, 1]
    try:
        return schedule_of(
            begins, begins, begins[:-1] + motion.waiting, ends, ramp=motion.ramp, period=period,
            start_rate=motion.start_rate, delay=delay, clock_error=eps,
        )  # fmt: skip
    except ValueError as error:
        raise PlanError(f"the plan's motion: {error}") from error


def governed_cells(plan: Plan, maps: Sequence[HarmonicMap]) -> list[GovernedCell]:
    """Return what a governor needs of every cell of a plan, given the map of every transition.

    Where the team follows a motion, maps are not read, and cells have no fields.
    """
    fields = [
        None if plan.motion else _field(maps[index], transition.gains.governor_gain)
        for index, transition in enumerate(plan.transitions)
    ]
    return [
        GovernedCell(
            BoundaryDistance(plan.governed(index)),
            field,
            transition.gains,
            before.gains,
        )
        for index, (transition, before, field) in enumerate(
            zip(plan.transitions, (plan.transitions[0], *plan.transitions[:-1]), fields, strict=True)
        )
    ]


def hold_of(scenario: Scenario, plan: Plan) -> Hold | None:
    """Return when the team is held by its funnels' clock, None for never: a team that passes has words."""
    return scenario.control.hold if plan.motion is None else None


def arrival_goal(scenario: Scenario, plan: Plan, joints: slice) -> ArrivalGoal:
    """Return the goal as a robot compares it with the means of what it measures.

    Args:
        scenario: The scenario.
        plan: The plan, along which angles are unwrapped.
        joints: Where the robot's joints stand in q.
    """
    allowed, budget, last = scenario.goal.tolerances, plan.budget, plan.transitions[-1]
    middles = 0.5 * (last.goal_lower + last.goal_upper)
    wanted = [plan.goal_pose[2], *plan.goal_joints[joints]]
    at = [middles[0], *middles[1:][joints]]
    turned = [
        middle if goal is None else goal + 2.0 * pi * round((middle - goal) / (2.0 * pi))
        for goal, middle in zip(wanted, at, strict=True)
    ]
    rooms = [
        allowed.position,
        allowed.angle,
        *(inf if goal is None else allowed.joint for goal in wanted[1:]),
    ]
    errors = np.zeros(len(rooms))
    if budget is not None:
        errors[:] = budget.angle_noise
        errors[:2] = budget.single_noise * np.array([budget.position_noise, budget.angle_noise])
    return ArrivalGoal(np.array([*plan.goal_pose[:2], *turned]), np.array(rooms), errors)


def _robot(scenario: Scenario, index: int, factor: float) -> RobotPlant:
    robot = build_robot_plant(scenario, index)
    if factor != 1.0:
        robot.scale_masses(factor)
    return robot


def _monitored(scenario: Scenario, plan: Plan, team: TeamPlant, robot: RobotModel) -> MonitoredRobot | None:
    """Return what a robot's monitor of departures needs, None where the plan has no budget."""
    deployment, away, budget = scenario.deployment, plan.departures, plan.budget
    if away is None or budget is None:
        return None
    if deployment.period is None:
        raise ScenarioError(
            str(scenario.path), "deployment.control_rate", None,
            f"a number, {budget.control_rate:g} Hz: the plan's budget holds for a sampled team",
        )  # fmt: skip
    own = [1, *range(2 + robot.q_slice.start, 2 + robot.q_slice.stop)]
    # By a wrong clock a robot measures itself earlier or later than the object's pose, while both move.
    assert plan.motion is not None  # departures are those from a motion
    moving = budget.clock_error * (moving_of(plan.motion).rate.max(axis=0) + away.rate)
    grasp = moving[0] + max(hypot(one.X_LE.x, one.X_LE.y) for one in team.robots) * moving[1]
    levels = (
        away.alarm[0],
        away.rate_alarm[0],
        inf if budget.grasp_noise is None else budget.grasp_noise + grasp,
        inf if budget.turn_noise is None else budget.turn_noise + moving[1],
        away.ahead_alarm[0],
    )
    return MonitoredRobot(
        chain=robot_chain(_robot(scenario, robot.index, 1.0)),
        p_LE=np.array([robot.X_LE.x, robot.X_LE.y]),
        mounting=base_chain(team, robot).mounting,
        levels=np.array(levels),
        unseen=unknown_time(budget),
        axis_alarms=np.array([away.alarm[own], away.rate_alarm[own], away.ahead_alarm[own]]),
        period=deployment.period,
        offset=deployment.of_robot(robot.name).sample_offset,
    )


def _field(harmonic_map: HarmonicMap, governor_gain: float) -> VelocityField:
    radius = slowdown_radius(FIELD_SPEED, governor_gain)
    return VelocityField(harmonic_map, FIELD_SPEED, slowdown_radius=radius)


def _check(plan: Plan, maps: Sequence[HarmonicMap], team: TeamPlant) -> None:
    if plan.joint_names != team.joint_names:
        raise PlanError(
            f"the plan moves the joints {', '.join(plan.joint_names)}; the scenario's team has "
            f"{', '.join(team.joint_names)}"
        )
    if plan.motion is None and len(maps) != len(plan.cells):
        raise PlanError(f"a plan of {len(plan.cells)} cells needs as many maps, not {len(maps)}")


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
    input   ``words``             (N + 1) m 9 in place of ``current_cell`` where the team passes from cell to
                                              cell: what everybody sent, see ``RobotWords``
    output  ``said``              9 m         what it sends, likewise; then ``ready`` is for the log alone
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
    if knowledge.schedule is None:
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
    passes = () if knowledge.schedule is None else PASSES
    for name in ("robot_effort", "ready", *TELEMETRY, *held, *alarm, *passes):
        builder.ExportOutput(outputs[name], name)
    return builder.Build()


def _blocks(knowledge: RobotKnowledge) -> dict[str, LeafSystem]:
    plan, cells, inertia, p_LE = knowledge.plan, knowledge.cells, knowledge.object_inertia, knowledge.p_LE
    joints = range(knowledge.joints.start, knowledge.joints.stop)
    axes = [0, *(1 + i for i in joints)]
    laws, paced = systems.axis_laws(plan, axes), knowledge.hold is not None
    judged = (
        cells,
        laws,
        [transition.inradius for transition in plan.transitions],
        plan.goal_pose[:2],
        knowledge.position_tolerance,
    )
    measured = knowledge.period is not None
    led: dict[str, LeafSystem]
    if plan.motion is not None and knowledge.schedule is not None and knowledge.radio is not None:
        period = knowledge.period
        led = {
            "robot_words": systems.RobotWords(
                knowledge.schedule,
                knowledge.radio,
                alarmed=knowledge.monitored is not None,
                ahead=None if period is None else 0.5 * period + knowledge.lag,
                age=knowledge.measurement_periods,
            ),
            "motion_follower": systems.MotionFollower(
                plan.motion,
                cells,
                laws,
                [2 + axis for axis in axes[1:]],
                knowledge.mounting if measured else None,
            ),
            "ready_monitor": systems.PassingMonitor(plan.motion, *judged, measured=measured),
        }
    else:
        led = {
            "reference_governor": systems.ReferenceGovernor(knowledge.cells, paced=paced),
            "axis_ppc": systems.AxisPpc(
                laws,
                start=plan.start[2:][np.array(axes)],
                period=knowledge.period,
                offset=knowledge.sample_offset,
                paced=paced,
            ),
            "ready_monitor": systems.ReadyMonitor(
                *judged,
                measured=measured,
            ),
        }
    return {
        "object_estimator": systems.ObjectEstimator(knowledge.robot, p_LE),
        **led,
        "wrench_law": systems.WrenchLaw(
            p_LE,
            p_LLcm=inertia.p_LLcm,
            mass=inertia.mass,
            inertia=inertia.inertia_about_com,
            share=knowledge.load_share,
            joints=len(joints),
        ),
        "robot_effort": systems.RobotEffort(knowledge.robot),
        **_additions(knowledge, laws),
    }


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
    if knowledge.hold is not None:
        period, offset = knowledge.period, knowledge.sample_offset
        silence = knowledge.hold.silence
        added["hold_receiver"] = systems.HoldReceiver(silence, period=period, offset=offset)
        added["funnel_clock"] = systems.FunnelClock(period, offset)
        energy = knowledge.hold.energy
        added["hold_monitor"] = systems.HoldMonitor(laws, energy, period=period, offset=offset)
    if knowledge.monitored is not None:
        joints = range(3 + knowledge.joints.start, 3 + knowledge.joints.stop)
        coordinates = knowledge.plan.start.size
        added["departure_monitor"] = systems.DepartureMonitor(knowledge.monitored, joints, coordinates)
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
        if "object_ahead" in outputs and label in _COMPENSATED:
            renamed |= _AHEAD
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
