"""Prepares what every robot knows before a run, from scenario, plan and maps."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, pi

import numpy as np

from coop_drake.answers.plan import Plan
from coop_drake.diagram.robot_controller import RobotKnowledge
from coop_drake.errors import PlanError, ScenarioError
from coop_drake.geometry.polygons import BoundaryDistance
from coop_drake.harmonic_maps import HarmonicMap, VelocityField
from coop_drake.laws.governor import FIELD_SPEED, slowdown_radius
from coop_drake.laws.measurements import observer_gains, whole_periods
from coop_drake.laws.readiness import ArrivalGoal, unseen_time
from coop_drake.plant import RobotPlant, TeamPlant, base_chain, build_robot_plant, robot_chain
from coop_drake.plant.team import RobotModel
from coop_drake.scenario import Hold, Scenario
from coop_drake.systems import AxisMotion, GovernedCell, MonitoredRobot, NominalMotion
from coop_drake.tree.pose import FloatArray

REPORT_PERIODS = 2
"""Periods in which p_G moves on in the old cell after a report was received [-]: the one in which the switch
is made, and the one after which robots hear of it."""


def robot_knowledge(
    scenario: Scenario, plan: Plan, maps: Sequence[HarmonicMap], team: TeamPlant
) -> list[RobotKnowledge]:
    """Return what each robot of a team knows before a run.

    Args:
        scenario: The scenario.
        plan: A plan for it.
        maps: The harmonic map of every transition.
        team: The simulated team.

    Raises:
        PlanError: The plan belongs to another team, or the number of maps is not the number of cells.
    """
    _check(plan, maps, team)
    cells = governed_cells(plan, maps)
    factor, deployment, control = 1.0 + scenario.deployment.mass_error, scenario.deployment, scenario.control
    hold = hold_of(scenario, plan)
    delay = whole_periods(deployment.measurements.delay, deployment.period) if deployment.period else 0
    return [
        RobotKnowledge(
            robot=_robot(scenario, robot.index, factor),
            X_LE=robot.X_LE,
            joints=robot.q_slice,
            object_inertia=team.object_inertia.scaled(factor),
            load_share=scenario.load_share(robot.name, len(team.robots)),
            plan=plan,
            cells=cells,
            position_tolerance=rest_tolerance(scenario, plan),
            period=deployment.period,
            sample_offset=deployment.of_robot(robot.name).sample_offset,
            predicted_periods=delay if control.predictor else 0,
            hold=hold,
            goal=arrival_goal(scenario, plan, robot.q_slice),
            observer_gains=observer_gains(scenario.command_age) if control.observer else None,
            motion=_motion(scenario, plan, robot.name, 0 if control.predictor else delay),
            measured_age=deployment.whole_delay,
            axis_motion=_axis_motion(scenario, plan, team, robot, 0 if control.predictor else delay),
            monitored=_monitored(scenario, plan, team, robot, delay),
        )
        for robot in team.robots
    ]


def governed_cells(plan: Plan, maps: Sequence[HarmonicMap]) -> list[GovernedCell]:
    """Return what a governor needs of every cell of a plan, given the map of every transition."""
    return [
        GovernedCell(
            BoundaryDistance(plan.governed(index)),
            _field(field_map, transition.gains.governor_gain),
            transition.gains,
            before.gains,
        )
        for index, (transition, before, field_map) in enumerate(
            zip(plan.transitions, (plan.transitions[0], *plan.transitions[:-1]), maps, strict=True)
        )
    ]


def rest_tolerance(scenario: Scenario, plan: Plan) -> float:
    """Return how close to the goal the position that robots go by counts as arrived [m]."""
    return float(scenario.goal.tolerances.position - (plan.tube.rest if plan.tube else 0.0))


def hold_of(scenario: Scenario, plan: Plan) -> Hold | None:
    """Return when the team is held, None for never; where a plan has a budget, monitors may ask for it."""
    return scenario.control.hold or (None if plan.alarms is None else Hold())


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


def report_periods(age: float, period: float) -> int:
    """Return for how many periods a report is used.

    Args:
        age: How long a report may be used after it was made [s].
        period: The control period [s].
    """
    return whole_periods(age, period) + REPORT_PERIODS


def _robot(scenario: Scenario, index: int, factor: float) -> RobotPlant:
    robot = build_robot_plant(scenario, index)
    if factor != 1.0:
        robot.scale_masses(factor)
    return robot


def _motion(scenario: Scenario, plan: Plan, robot: str, age: int) -> NominalMotion | None:
    """Return the nominal motion of a plan with a position tube, None for other plans."""
    if plan.tube is None or plan.budget is None:
        return None
    deployment, budget = scenario.deployment, plan.budget
    if deployment.period is None:
        raise ScenarioError(
            str(scenario.path), "deployment.control_rate", None,
            f"a number, {budget.control_rate:g} Hz: the plan's budget holds for a sampled team",
        )  # fmt: skip
    return NominalMotion(
        tube=plan.tube,
        start=plan.start[:2],
        targets=np.array([transition.target for transition in plan.transitions]),
        period=deployment.period,
        report_periods=report_periods(budget.report_age, deployment.period),
        measurement_periods=age,
        offset=deployment.of_robot(robot).sample_offset,
    )


def _axis_motion(
    scenario: Scenario, plan: Plan, team: TeamPlant, robot: RobotModel, age: int
) -> AxisMotion | None:
    """Return the nominal motion of a robot's axes, None where the plan's budget has none."""
    deployment, tracking = scenario.deployment, plan.axis_tracking
    if plan.budget is None or tracking is None or deployment.period is None:
        return None
    joints = range(1 + robot.q_slice.start, 1 + robot.q_slice.stop)
    return AxisMotion(
        tracking=tracking,
        start=plan.start[2:][[0, *joints]],
        period=deployment.period,
        lag=plan.budget.lag,
        measurement_periods=age,
        mounting=base_chain(team, robot).mounting,
        offset=deployment.of_robot(robot.name).sample_offset,
    )


def _monitored(
    scenario: Scenario, plan: Plan, team: TeamPlant, robot: RobotModel, age: int
) -> MonitoredRobot | None:
    """Return what a robot's monitor of departures needs, None where the plan has no budget."""
    deployment, alarms, budget = scenario.deployment, plan.alarms, plan.budget
    if alarms is None or budget is None or deployment.period is None:
        return None
    own = [0, *range(1 + robot.q_slice.start, 1 + robot.q_slice.stop)]
    times, axis_alarms = axis_levels(plan)
    return MonitoredRobot(
        chain=robot_chain(_robot(scenario, robot.index, 1.0)),
        p_LE=np.array([robot.X_LE.x, robot.X_LE.y]),
        mounting=base_chain(team, robot).mounting,
        levels=np.array(
            [
                inf if one is None else one
                for one in (alarms.position, alarms.velocity, alarms.grasp, alarms.turn, alarms.ahead)
            ]
        ),
        unseen=unseen_time(budget.delay, budget.report_age, budget.period, budget.age_error),
        axis_alarms=axis_alarms[..., own] if axis_alarms.size else axis_alarms,
        alarm_times=times,
        start=plan.start[[0, 1, *(2 + i for i in own)]],
        period=deployment.period,
        measurement_periods=age,
        offset=deployment.of_robot(robot.name).sample_offset,
    )


def axis_levels(plan: Plan) -> tuple[FloatArray, FloatArray]:
    """Return when the stages of all cells begin, and the levels of all axes in them: ``MonitoredRobot``."""
    stated = [one.tolerance for one in plan.transitions if one.tolerance is not None]
    stages = max((one.alarm_times.size for one in stated), default=1)
    axes = plan.start.size - 2 if stated else 0
    times, levels = np.full((len(plan.cells), stages), inf), np.empty((len(plan.cells), stages, 3, axes))
    for k, one in enumerate(stated):
        times[k, : one.alarm_times.size] = one.alarm_times
        for i in range(stages):
            row = min(i, len(one.alarm) - 1)
            levels[k, i] = one.alarm[row], one.rate_alarm, one.ahead_alarm[row]
    return times, levels


def _field(harmonic_map: HarmonicMap, governor_gain: float) -> VelocityField:
    radius = slowdown_radius(FIELD_SPEED, governor_gain)
    return VelocityField(harmonic_map, FIELD_SPEED, slowdown_radius=radius)


def _check(plan: Plan, maps: Sequence[HarmonicMap], team: TeamPlant) -> None:
    if plan.tube is not None and plan.alarms is None:
        raise PlanError("the plan has a budget, but no alarm levels: plan again")
    if plan.joint_names != team.joint_names:
        raise PlanError(
            f"the plan moves the joints {', '.join(plan.joint_names)}; the scenario's team has "
            f"{', '.join(team.joint_names)}"
        )
    if len(maps) != len(plan.cells):
        raise PlanError(f"a plan of {len(plan.cells)} cells needs as many maps, not {len(maps)}")
