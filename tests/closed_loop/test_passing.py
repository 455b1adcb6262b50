"""Transports that pass from cell to cell without a stop: runs in Drake, their logs, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.framework import Context, DiscreteValues
from scipy.interpolate import BSpline

from coop_drake import Found, load_scenario, plan
from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.cli.summary import simulation_facts
from coop_drake.diagram import RobotKnowledge, build_closed_loop
from coop_drake.diagram.robot_controller import team_schedule
from coop_drake.errors import PlanError, RefusalError, ScenarioError
from coop_drake.laws.words import ASKS, CLOCK_ERROR, WORD_SIZE
from coop_drake.planning.motion_limits import largest_forces
from coop_drake.plant.facts import run_setup
from coop_drake.scenario import (
    ActuatorLimits,
    Control,
    Deafness,
    Deployment,
    Hold,
    Measurements,
    Messages,
    RobotDepartures,
    Scenario,
    Silence,
)
from coop_drake.scenario.checks import validate
from coop_drake.scenario.model import RobotLimits, Tolerances
from coop_drake.simulation import build_maps, simulate
from coop_drake.systems.passing import SAID, RobotWords
from coop_drake.verification.motion import _movers
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
    gathering = 1.5 * motion.waiting  # 3 W, from which the start is heard to the start
    assert log.times[-1] == pytest.approx(motion.duration + gathering, rel=0.005)
    spline = BSpline(motion.period * (np.arange(len(motion.points) + 4) - 3.0), motion.points, 3)
    nominal = spline(log.phases[:, 1, 0])
    # The integrator's error: ten times what is seen.
    np.testing.assert_allclose(np.hstack([log.object_pose, log.joints]), nominal, rtol=0, atol=1e-4)


def test_forces_of_bases_are_what_accelerates_all_that_they_move(transport: Transport) -> None:
    """At full pace: the mass that a base moves times the acceleration of its centre along the motion."""
    _, problem, plan, log = transport
    motion, limits = plan.motion, problem.limits
    assert motion is not None
    spline = BSpline(motion.period * (np.arange(len(motion.points) + 4) - 3.0), motion.points, 3)
    phases = log.phases[log.phases[:, 1, 1] == 1.0, 1, 0]
    rates = [spline.derivative(order)(phases) if order else spline(phases) for order in range(3)]
    found = log.base_wrenches[log.phases[:, 1, 1] == 1.0, :, :2]
    centres = [mover for mover in _movers(problem) if mover.name.startswith("the centre")]
    for k, centre in enumerate(centres):
        mass = sum(mass for _, mass, *_, robot in limits.bodies if robot == k)
        force = mass * np.linalg.norm(centre.rates(*rates)[1], axis=1)
        np.testing.assert_allclose(np.linalg.norm(found[:, k], axis=1), force, atol=0.05)
        assert force.max() > 5.0
    facts = simulation_facts(plan, log, problem)
    most = largest_forces(limits)
    np.testing.assert_allclose(most, [0.5 * 9.81 * 8.5] * 2)
    assert facts["force_n"] == pytest.approx(np.linalg.norm(log.base_wrenches[..., :2], axis=2).max())
    assert (facts["force_by"], facts["force_limit_n"]) == ("friction", most[0])
    drives = replace(problem, limits=replace(limits, base_forces=np.array([30.0, 50.0])))
    found = simulation_facts(plan, log, drives)
    assert (found["force_of"], found["force_by"]) == ("robot_0", "base_force")


def test_it_never_stops_between_start_and_goal(transport: Transport) -> None:
    _, _, plan, log = transport
    speed = np.hypot(log.object_twist[:, 0], log.object_twist[:, 1])
    within = (log.times > 1.0) & (log.times < log.times[-1] - 1.0)
    assert speed[within].min() > 0.2
    last = np.flatnonzero(np.diff(log.cell_index))
    assert len(last) == len(plan.cells) - 1
    assert plan.motion is not None
    late = log.phases[last, 0, 0] - plan.motion.windows[1:, 0]
    assert ((late >= 0.0) & (late <= 0.005)).all()  # seen at the next sample


def test_its_log_is_verified_and_an_altered_one_refused(transport: Transport) -> None:
    scenario, problem, plan, log = transport
    setup = run_setup(scenario)
    assert verify_log(log, plan, problem, setup).answer == "arrived"
    middle = len(log.times) // 2
    for name, shift, where in (
        ("phases", 1e-6, f"phases[{middle}"),
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
        ({"period": 1.001 * motion.period}, "phases"),
        ({"windows": motion.windows + np.array([0.05, 0.0])}, "cell_index"),
        ({"points": motion.points + 1e-5 * np.eye(motion.points.shape[1])[-1]}, "accelerations"),
    ):
        other = replace(plan, motion=replace(motion, **changes))
        with pytest.raises(RefusalError) as refusal:
            check_followed(Rows(log, other), problem, exact=True)
        assert refusal.value.where.startswith(where)


def test_a_run_that_is_given_too_little_time_says_from_which_phase_the_motion_goes_on(transport: Transport):
    scenario, _, plan, _ = transport
    brief = replace(scenario, simulator=replace(scenario.simulator, max_time=1.0))
    assert "the motion goes on from the phase" in simulate(brief, plan, build_maps(plan)).violation


class Alarmed(RobotWords):
    """A robot whose monitor asks for a hold for a while."""

    def _judge(self, context: Context, discrete_state: DiscreteValues) -> None:
        super()._judge(context, discrete_state)
        if 4.0 <= context.get_time() < 5.0:
            discrete_state.get_mutable_vector().get_mutable_value()[self._more + SAID] = ASKS


def alarmed(known: RobotKnowledge) -> RobotWords:
    """The words of a team whose robot 1 has an alarm."""
    assert known.schedule is not None
    assert known.radio is not None
    return (Alarmed if known.radio.row == 1 else RobotWords)(known.schedule, known.radio)


@pytest.mark.parametrize("cause", ["person", "monitor"])
def test_a_held_team_rests_within_its_cell_and_goes_on(transport: Transport, cause: str) -> None:
    scenario, problem, plan, before = transport
    motion, replacements = plan.motion, None
    assert motion is not None
    if cause == "person":
        scenario = replace(scenario, control=Control(hold=Hold(at=(4.0,), duration=4.0)))
    else:
        replacements = {"robot_words": alarmed}
    log = simulate(scenario, plan, build_maps(plan), replacements=replacements)
    assert verify_log(log, plan, problem, run_setup(scenario)).answer == "arrived"
    phase, pace, _ = log.phases[:, 0].T
    rests = (pace == 0.0) & (log.times > 1.0) & (log.times < log.times[-1] - 1.0)
    held = log.times[log.held > 0.0]
    place = phase[rests][0]
    assert np.abs(motion.windows[:-1, 1] - place).min() < 1e-9  # where a stop from a brake phase ends
    assert phase[rests] == pytest.approx(place, abs=1e-12)
    assert np.hypot(*log.object_twist[rests, :2].T).max() < 1e-4
    if cause == "person":
        assert held[-1] == pytest.approx(8.0, abs=0.006)
    # What the stop takes on its way, and the start.
    assert log.times[-1] > before.times[-1] + 1.0


@pytest.mark.parametrize("fault", ["deaf", "mute"])
def test_a_deployed_team_stops_where_words_lack_goes_on_and_arrives(transport: Transport, fault: str) -> None:
    """All that is stated at once: late measurements, lagging motors, lost and late words, wrong clocks."""
    ideal, problem, plan, _ = transport
    lost = {"deaf": Deafness(5.0, 0.5)} if fault == "deaf" else {"silence": Silence(5.0, 0.5)}
    deployment = Deployment(
        control_rate=200.0,
        measurements=Measurements(delay=0.02),
        actuators=ActuatorLimits(lag=0.01),
        messages=Messages(delay=0.01, loss=0.1),
        robots={"robot_1": RobotDepartures(clock_error=0.0005, sample_offset=0.002, **lost)},
    )
    scenario = replace(ideal, deployment=deployment)
    log = simulate(scenario, plan, build_maps(plan))
    assert verify_log(log, plan, problem, run_setup(scenario)).answer == "arrived"
    pace = log.phases[..., 1]
    rests = (pace == 0.0).all(axis=1) & (log.times > 5.0) & (log.times < log.times[-1] - 1.0)
    assert np.ptp(log.phases[rests, :, 0]) == 0.0
    assert 5.0 < log.times[rests][0] < 8.0
    spline = BSpline(
        plan.motion.period * (np.arange(len(plan.motion.points) + 4) - 3.0), plan.motion.points, 3
    )
    away = np.hstack([log.object_pose, log.joints]) - spline(log.phases[:, 0, 0])
    assert np.abs(away).max() < 1e-3  # about what the clock's error moves by: 0.5 m/s


def test_between_robots_only_words_cross() -> None:
    scenario, plan = small_problem("base")
    deployment = Deployment(control_rate=200.0, messages=Messages(delay=0.01))
    loop = build_closed_loop(replace(scenario, deployment=deployment), with_motion(plan), small_maps())
    crossing = {
        (source.get_output_port(output).get_name(), source.get_output_port(output).size())
        for (sink, _), (source, output) in loop.diagram.connection_map().items()
        if "transport_station" not in (source.get_name(), sink.get_name())
    }
    rows = 1 + 2  # of the last periods: words are late by two
    robots = len(loop.controllers)
    assert {size for name, size in crossing if name == "said"} == {rows * WORD_SIZE}
    assert {size for name, size in crossing if name != "said"} == {(robots + 1) * rows * WORD_SIZE}


def test_a_hold_by_energies_of_funnels_is_refused_by_key() -> None:
    scenario = passing(load_scenario("warehouse"))
    for key in ("energy", "silence"):
        held = replace(scenario, control=Control(hold=Hold(**{key: 2.0})))
        with pytest.raises(ScenarioError, match=rf"control\.hold\.{key}"):
            validate(held)


def test_words_that_are_later_than_the_motion_allows_are_refused() -> None:
    scenario, plan = small_problem("base")
    late = Deployment(control_rate=200.0, messages=Messages(delay=0.06))
    for deployment, key in ((late, r"messages\.delay"), (Deployment(control_rate=20.0), "control_rate")):
        with pytest.raises(ScenarioError, match=rf"deployment\.{key}"):
            team_schedule(replace(scenario, deployment=deployment), with_motion(plan))


def test_words_may_be_exactly_as_late_as_the_motion_allows() -> None:
    scenario, plan = small_problem("base")
    plan = with_motion(plan)
    assert plan.motion is not None
    sampled = replace(scenario, deployment=Deployment(control_rate=150.0))
    waiting = 4.0 * (CLOCK_ERROR + 1.0 / 150.0)
    exact = replace(plan, motion=replace(plan.motion, waiting=waiting))
    assert 0.5 * waiting - 2.0 * CLOCK_ERROR - 2.0 / 150.0 < 0.0  # by rounding
    schedule = team_schedule(sampled, exact)
    assert schedule is not None
    assert schedule.window == pytest.approx(0.5 * waiting)
    shorter = replace(plan, motion=replace(plan.motion, waiting=0.99 * waiting))
    with pytest.raises(ScenarioError, match="control_rate"):
        team_schedule(sampled, shorter)


def test_cells_of_a_plan_with_a_budget_overlap_for_as_long_as_clocks_may_differ() -> None:
    clocks = Deployment(control_rate=200.0, clock_error=0.025, budget="all")
    goal = replace(load_scenario("warehouse").goal, tolerances=Tolerances(position=0.1, angle=0.1))
    scenario = replace(load_scenario("warehouse"), deployment=clocks, goal=goal)
    found = plan(scenario)
    assert isinstance(found, Found)
    assert found.plan.motion is not None
    windows = found.plan.motion.windows
    assert (windows[:-1, 1] - windows[1:, 0] >= 2.0 * 0.025).all()
    assert team_schedule(scenario, found.plan) is not None


def test_a_motion_that_makes_no_schedule_is_refused() -> None:
    scenario, plan = small_problem("base")
    plan = with_motion(plan)
    assert plan.motion is not None
    windows = plan.motion.windows.copy()
    windows[0, 1] = windows[1, 0] + 1.9 * CLOCK_ERROR
    with pytest.raises(PlanError, match="must overlap for at least"):
        team_schedule(scenario, replace(plan, motion=replace(plan.motion, windows=windows)))


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
