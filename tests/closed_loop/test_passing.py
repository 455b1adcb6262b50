"""Transports that pass from cell to cell without a stop: runs in Drake, their logs, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import BSpline

from coop_drake import load_scenario
from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.diagram import build_closed_loop
from coop_drake.errors import RefusalError, ScenarioError
from coop_drake.plant.facts import run_setup
from coop_drake.scenario import Control, Deployment, Hold, Scenario
from coop_drake.scenario.checks import validate
from coop_drake.scenario.model import RobotLimits
from coop_drake.simulation import build_maps, simulate
from coop_drake.verification.runs.motion import check_followed
from coop_drake.verification.runs.rows import Rows
from coop_drake.verification.runs.verify_log import verify_log
from tests.support.motions import passing, planned_motion
from tests.support.small_loop import small_maps, small_problem
from tests.support.small_plan import with_motion

Transport = tuple[Scenario, PlanningProblem, Plan, SimulationLog]


@pytest.fixture(scope="module")
def transport() -> Transport:
    scenario, (plan, problem) = passing(load_scenario("warehouse")), planned_motion("warehouse")
    return scenario, problem, plan, simulate(scenario, plan, build_maps(plan))


def test_the_team_arrives_when_the_motion_says_and_follows_it(transport: Transport) -> None:
    _, _, plan, log = transport
    motion = plan.motion
    assert motion is not None
    assert log.reached
    assert log.times[-1] == pytest.approx(motion.duration, rel=0.02)
    spline = BSpline(motion.period * (np.arange(len(motion.points) + 4) - 3.0), motion.points, 3)
    nominal = spline(np.minimum(log.times, motion.duration))
    # The integrator's error: ten times what is seen.
    np.testing.assert_allclose(np.hstack([log.object_pose, log.joints]), nominal, rtol=0, atol=1e-4)


def test_it_never_stops_between_start_and_goal(transport: Transport) -> None:
    _, _, plan, log = transport
    speed = np.hypot(log.object_twist[:, 0], log.object_twist[:, 1])
    within = (log.times > 1.0) & (log.times < log.times[-1] - 1.0)
    assert speed[within].min() > 0.2
    entered = log.times[np.flatnonzero(np.diff(log.cell_index)) + 1]
    assert len(entered) == len(plan.cells) - 1
    assert plan.motion is not None
    late = entered - plan.motion.windows[1:, 0]
    assert (late >= 0.0).all()
    # Readiness is seen at the end of a step, the switch at the end of the next one; steps are 0.02 s at most.
    assert (late <= 0.04 + 1e-9).all()


def test_its_log_is_verified_and_an_altered_one_refused(transport: Transport) -> None:
    scenario, problem, plan, log = transport
    setup = run_setup(scenario)
    assert verify_log(log, plan, problem, setup).answer == "arrived"
    middle = len(log.times) // 2
    for name, shift, where in (
        ("governor_position", 1e-6, f"governor_position[{middle}"),
        ("energy_margin", 1e-4, f"energy_margin[{middle}"),
        ("ready_margins", 1e-3, f"ready_margins[{middle}"),
        ("funnel_upper", 1e-6, f"funnel_margin[{middle}"),
        ("object_pose", 1e-4, f"object_pose, joints[{middle}"),
        ("accelerations", 1e-4, f"accelerations[{middle}"),
        ("cell_index", 1, f"cell_index[{middle + 1}"),
    ):
        changed = getattr(log, name).copy()
        changed[middle] += shift
        with pytest.raises(RefusalError) as refusal:
            verify_log(replace(log, **{name: changed}), plan, problem, setup)
        assert refusal.value.where.startswith(where)


def test_a_run_off_its_motion_is_refused(transport: Transport) -> None:
    """The log is whole in itself, but of another motion: later, or pulled to with other gains."""
    _, problem, plan, log = transport
    motion = plan.motion
    assert motion is not None
    rows = Rows(log, plan)
    assert len(check_followed(rows, problem, exact=True)) == 8
    for changes, where in (
        ({"period": 1.001 * motion.period}, "governor_position"),
        ({"windows": motion.windows + np.array([0.05, 0.0])}, "cell_index"),
        ({"points": motion.points + 1e-5 * np.eye(motion.points.shape[1])[-1]}, "accelerations"),
    ):
        other = replace(plan, motion=replace(motion, **changes))
        with pytest.raises(RefusalError) as refusal:
            check_followed(Rows(log, other), problem, exact=True)
        assert refusal.value.where.startswith(where)


def test_a_motion_is_for_an_ideal_team_that_is_not_held() -> None:
    scenario, plan = small_problem("base")
    for changes in ({"deployment": Deployment(control_rate=100.0)}, {"control": Control(hold=Hold())}):
        with pytest.raises(ScenarioError, match="ideal team"):
            build_closed_loop(replace(scenario, **changes), with_motion(plan), small_maps())


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("planner: {hand_over: pass}\ndeployment: {preset: mobile_base}", "planner.hand_over"),
        ("planner: {hand_over: pass}\ncontrol: {hold: {at: [1.0]}}", "planner.hand_over"),
        ("planner: {hand_over: stop}", "planner.hand_over"),
    ],
)
def test_scenarios_that_cannot_pass_are_refused_by_key(tmp_path, text, key) -> None:
    shipped = load_scenario("warehouse").path.read_text()
    path = tmp_path / "other.scenario.yaml"
    path.write_text(f"{shipped}\n{text}\n")
    with pytest.raises(ScenarioError, match=key):
        load_scenario(path)


@pytest.mark.parametrize(
    ("limits", "key"),
    [
        ({"*": RobotLimits(acceleration=1.0)}, r"limits\.\*\.acceleration"),
        ({"object": RobotLimits(base_speed=1.0)}, r"limits\.object"),
    ],
)
def test_limits_of_the_object_stand_under_its_name_alone(limits, key) -> None:
    scenario = load_scenario("warehouse")
    validate(replace(scenario, limits={"object": RobotLimits(acceleration=1.0)}))
    with pytest.raises(ScenarioError, match=key):
        validate(replace(scenario, limits=limits))
