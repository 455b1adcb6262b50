"""The compiled loop against Drake's, run by run and in a campaign."""

from dataclasses import asdict, replace
from functools import cache

import numpy as np
import pytest

from coop_drake.campaign.file import load_campaign
from coop_drake.campaign.plans import Plans
from coop_drake.campaign.records import RunRecord
from coop_drake.campaign.runs import RunMaker, _times_held
from coop_drake.campaign.variation import Variation
from coop_drake.cli.campaign import _compare, _show_both
from coop_drake.cli.reporter import Reporter
from coop_drake.compiled_loop import prepare, preparing, run, with_gains
from coop_drake.errors import ProcessError, RefusalError, ScenarioError
from coop_drake.laws import ScheduledGains
from coop_drake.planning import reschedule
from coop_drake.plant.team import displacement
from coop_drake.scenario import (
    ActuatorLimits,
    BlockedWheels,
    Control,
    Deafness,
    Deployment,
    Floor,
    Hold,
    JointFriction,
    Measurements,
    Messages,
    PlantSettings,
    PoseBias,
    Push,
    RobotDepartures,
    Silence,
    StartOffset,
    Wave,
    Waves,
    WheelSlip,
)
from coop_drake.simulation import simulate
from coop_drake.verification.runs import Rows, budget_share
from coop_drake.verification.runs.verify_log import check_start
from tests.support.motions import motion_under_budget, small_motion
from tests.support.small_loop import small_maps, small_problem
from tests.support.stepped import assert_moves_as

PRESET = Deployment(
    control_rate=200.0,
    mass_error=0.2,
    measurements=Measurements(0.001, 0.0005, 0.01, 0.01),
    actuators=ActuatorLimits(base_force=300.0, lag=0.005),
    messages=Messages(loss=0.2),
)


def at_200_hz(**departures):
    return Deployment(control_rate=200.0, **departures)


def of_one(**departures):
    return at_200_hz(robots={"robot_0": RobotDepartures(**departures)})


CASES = {
    "rate": Deployment(control_rate=100.0),
    "model error": at_200_hz(mass_error=-0.3),
    "noise": at_200_hz(measurements=Measurements(1e-3, 5e-4, 1e-2), seed=3),
    "waves": at_200_hz(measurements=Measurements(waves=Waves(x=Wave(2e-3, 0.3), joints=Wave(1e-3, 0.5)))),
    "delay": at_200_hz(measurements=Measurements(delay=0.008)),
    "lost and late": at_200_hz(measurements=Measurements(loss=0.1, late=0.2, late_by=0.012), seed=2),
    "limits": at_200_hz(actuators=ActuatorLimits(base_force=100.0, base_torque=50.0, joint_effort=20.0)),
    "lag": at_200_hz(actuators=ActuatorLimits(lag=0.005)),
    "reports": at_200_hz(messages=Messages(loss=0.5, repeat=0.3, delay=0.02), seed=4),
    "pose and odometry": of_one(pose_bias=PoseBias(0.004, -0.002, 0.001), odometry_scale=0.05),
    "clock": of_one(clock_error=0.03, switch_delay=0.02),
    "wrong clocks": at_200_hz(clock_error=0.006, measurements=Measurements(delay=0.01), seed=5),
    "wrong clocks of present measurements": at_200_hz(clock_error=0.004, measurements=Measurements(5e-4)),
    "silence": of_one(silence=Silence(0.5, 0.02, motors="limp")),
    "silence from the start": of_one(silence=Silence(0.0, 1.2)),
    "blocked wheels": of_one(blocked=BlockedWheels(0.5, 0.02)),
    "wheels that slip": of_one(slip=WheelSlip(0.5, 0.3, 0.2)),
    "held motors": of_one(silence=Silence(0.5, 0.02, motors="held")),
    "floor": at_200_hz(floor=Floor(coulomb_friction=5.0, viscous_friction=5.0, slope=0.01)),
    "dry friction of joints": at_200_hz(joint_friction=JointFriction(coulomb=0.3)),
    "friction of joints": at_200_hz(joint_friction=JointFriction(coulomb=0.2, viscous=0.3)),
    "start": at_200_hz(start_offset=StartOffset(2e-3, -1e-3, 1e-3, (1e-3, -5e-4))),
    "push": at_200_hz(pushes=(Push("robot_1", (15.0, 5.0), 0.5, 0.5, torque=1.0),)),
}


ABRUPT = {"push", "blocked wheels", "wheels that slip"}
"""Departures whose steps Drake's integrator follows less closely."""


@cache
def prepared(team="base"):
    scenario, plan = small_problem(team)
    return prepare(replace(scenario, deployment=at_200_hz()), plan, small_maps())


def both(transport, deployment, maps):
    """The outcome of the compiled loop, and the log of Drake's."""
    scenario = replace(transport.scenario, deployment=deployment)
    return run(transport, deployment), simulate(scenario, transport.plan, maps)


def assert_agree(outcome, log, *, close=1e-5):
    """Drake's log also has rows between samples where efforts lag, and integrates within an accuracy."""
    assert outcome.arrived == log.reached
    assert outcome.arrived, (outcome.reason, log.violation)
    assert outcome.time == pytest.approx(log.times[-1], abs=0.0051)
    assert outcome.funnel_margin == pytest.approx(log.funnel_margin.min(), abs=close)
    assert outcome.wall_clearance == pytest.approx(log.workspace_clearance.min(), abs=close)
    assert outcome.body_clearance == pytest.approx(log.body_clearance.min(), abs=close)
    forces = np.hypot(log.base_wrenches[..., 0], log.base_wrenches[..., 1])
    assert outcome.peak_force == pytest.approx(forces.max(), rel=2e-3)
    assert outcome.peak_torque == pytest.approx(np.abs(log.joint_torques).max(), rel=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_each_departure_has_the_same_effect(name):
    outcome, log = both(prepared(), CASES[name], small_maps())
    assert_agree(outcome, log)
    assert_moves_as(prepared(), CASES[name], log, 1e-4 if name in ABRUPT else 1e-5)
    assert repr(outcome) != repr(run(prepared()))


def test_cells_are_measured_at_the_same_samples():
    outcome, log = both(prepared(), at_200_hz(), small_maps())
    assert outcome.cell_margin == pytest.approx(log.cell_clearance.min(), abs=1e-6)
    assert outcome.steps == round(log.times[-1] * 200.0)
    axes = np.c_[log.object_pose[:, 2], log.joints]
    margins = np.minimum(axes - log.funnel_lower, log.funnel_upper - axes)
    row, axis = np.unravel_index(np.argmin(margins), margins.shape)
    assert outcome.funnel_axis == ("angle", *log.joint_names)[axis]
    assert outcome.funnel_cell == log.cell_index[row]


def test_other_gains_change_the_cells_alone():
    transport, plan = prepared(), reschedule(prepared().plan, ScheduledGains(age_phase=0.3), "other")
    found, expected = (
        with_gains(transport, plan, small_maps()),
        prepare(transport.scenario, plan, small_maps()),
    )
    assert repr(run(found)) == repr(run(expected)) != repr(run(transport))


@pytest.mark.slow
@pytest.mark.parametrize(("size", "accepted"), [(1.0, True), (1.1, False)])
def test_a_start_within_the_errors_of_the_budget_is_accepted_and_no_other(size, accepted):
    scenario, plan = motion_under_budget()
    place, noise = size * plan.budget.position_noise, size * plan.budget.angle_noise
    away = StartOffset(0.6 * place, -0.8 * place, noise, (-noise, noise))
    usual = replace(scenario.deployment, start_offset=away)
    outcome, log = both(prepare(scenario, plan, small_maps()), usual, small_maps())
    assert_agree(outcome, log, close=5e-5)
    assert outcome.budget_share < 1.0
    stood = displacement(Deployment(start_offset=away), len(plan.start))
    if accepted:
        assert check_start(Rows(log, plan), stood).tightest == pytest.approx(place)
    else:
        with pytest.raises(RefusalError, match="off the plan's start"):
            check_start(Rows(log, plan), stood)
    with pytest.raises(RefusalError, match="object_pose"):
        check_start(Rows(log, plan), 0.5 * stood)


def test_a_lost_run_ends_where_and_why_it_does_in_drake():
    harsh = Deployment(control_rate=100.0, measurements=Measurements(delay=0.1))
    outcome, log = both(prepared(), harsh, small_maps())
    assert not outcome.arrived
    assert outcome.time == pytest.approx(log.times[-1])
    place = "distance of {} to its funnel is -0.0146 rad or m"
    assert outcome.reason.endswith(place.format("angle"))
    assert place.format("object angle") in log.violation


def test_the_same_seed_gives_the_same_run_and_another_seed_another_one():
    runs = [run(prepared(), replace(PRESET, seed=seed)) for seed in (1, 1, 2)]
    first, again, other = map(repr, runs)
    assert first == again
    assert first != other
    assert repr(run(prepared(), PRESET, seed=2)) == other


@pytest.mark.parametrize(
    ("key", "change"),
    [
        ("plant.grasps", {"plant": PlantSettings(grasps="constraints")}),
        ("control.predictor", {"control": Control(predictor=True)}),
        ("control.observer", {"control": Control(observer=True)}),
        ("control.hold", {"control": Control(hold=Hold())}),
        ("deployment.control_rate", {"deployment": Deployment()}),
        ("deployment.robots.robot_0.sample_offset", {"deployment": of_one(sample_offset=0.001)}),
    ],
)
def test_what_the_loop_does_not_know_is_refused(key, change):
    scenario, plan = small_problem()
    asked = replace(scenario, **{"deployment": at_200_hz(), **change})
    with pytest.raises(ScenarioError) as refusal:
        run(prepare(asked, plan, small_maps()))
    assert key in str(refusal.value)


EVERYTHING = Deployment(
    control_rate=200.0,
    mass_error=0.1,
    measurements=Measurements(1e-3, 5e-4, 1e-2, 0.008, loss=0.1, late=0.2, late_by=0.012,
                              waves=Waves(x=Wave(2e-3, 0.3), joints=Wave(1e-3, 0.5))),
    actuators=ActuatorLimits(base_force=60.0, lag=0.005),
    messages=Messages(loss=0.3, repeat=0.3, delay=0.01),
    robots={
        "robot_0": RobotDepartures(pose_bias=PoseBias(0.002, -0.001, 0.001), odometry_scale=0.05,
                                   clock_error=0.02, switch_delay=0.01, slip=WheelSlip(0.1, 0.3, 0.1)),
        "robot_1": RobotDepartures(silence=Silence(0.3, 0.02, motors="held"),
                                   blocked=BlockedWheels(0.45, 0.02)),
    },
    floor=Floor(coulomb_friction=2.0, viscous_friction=2.0, slope=0.01),
    joint_friction=JointFriction(coulomb=0.2, viscous=0.1),
    pushes=(Push("robot_1", (15.0, 5.0), 0.2, 0.2, torque=1.0),),
    seed=3,
)  # fmt: skip


NO_DELAY = Deployment(
    control_rate=100.0,
    measurements=Measurements(1e-3, 5e-4, 1e-2, loss=0.2, late=0.2, late_by=0.012),
    robots={"robot_1": RobotDepartures(silence=Silence(0.3, 0.02, motors="limp"))},
    start_offset=StartOffset(1e-3, -1e-3, 1e-3, (-1e-3, 1e-3)),
)


@pytest.mark.slow
@pytest.mark.parametrize("deployment", [EVERYTHING, NO_DELAY], ids=["everything", "no delay"])
def test_all_departures_together_have_the_same_effect_at_every_sample(deployment):
    scenario, plan = small_problem("base")
    brief = replace(scenario.simulator, max_time=0.6)
    scenario = replace(scenario, deployment=deployment, simulator=brief)
    log = simulate(scenario, plan, small_maps())
    assert_moves_as(prepare(scenario, plan, small_maps()), deployment, log, 1e-4)


# A campaign whose runs are made by both loops.


FILE = """
runs:
  scenarios: [warehouse]
  count: 2
  seed: 5
  tier: both
  set: {deployment.preset: mobile_base, deployment.messages.loss: 0.0}
  vary:
    deployment.mass_error: !Uniform {min: -0.2, max: 0.2}
"""


@pytest.mark.slow
@pytest.mark.parametrize("gains", ["scheduled", "null"])
def test_both_tiers_leave_the_same_record(gains, tmp_path, monkeypatch):
    path, prepared = tmp_path / "both.campaign.yaml", []
    path.write_text(FILE.replace("set: {", f"set: {{gains.selected: {gains}, "))
    variation = Variation(load_campaign(path))
    plans = Plans(variation, tmp_path)
    monkeypatch.setattr(preparing, "_check", lambda scenario, **_: prepared.append(scenario))
    compiled, drake = (RunMaker(variation, plans, tier, tmp_path) for tier in ("compiled", "drake"))
    records = [compiled.record(variation.run(index)) for index in range(2)]
    assert len(prepared) == 1
    assert records[0].funnel_margin != records[1].funnel_margin
    found, expected = asdict(records[1]), asdict(drake.record(variation.run(1)))
    assert (found.pop("tier"), expected.pop("tier")) == ("compiled", "drake")
    assert found.pop("digest") != expected.pop("digest")
    for name in ("run", "scenario", "seed", "values", "arrived", "reason", "funnel_axis", "held"):
        assert found[name] == expected[name]
    assert found["time"] == pytest.approx(expected["time"], abs=0.0051)
    for name in ("funnel_margin", "wall_clearance", "body_clearance"):
        assert found[name] == pytest.approx(expected[name], abs=5e-4)
    assert found["peak_force"] == pytest.approx(expected["peak_force"], rel=2e-3)


@pytest.mark.slow
def test_a_replay_shows_both_tiers_and_refuses_another_run():
    counted = RunRecord(3, "warehouse", "compiled", 7, "{}", arrived=True, time=10.0, steps=2000)
    drake, reporter = replace(counted, tier="drake", time=10.005), Reporter(machine=True, quiet=True)
    _show_both(drake, counted, reporter)
    assert reporter.facts["tiers"]["time"] == [10.005, 10.0]
    assert reporter.facts["tiers"]["budget_share"] == [None, None]
    _compare(counted, asdict(counted), reporter)
    assert reporter.facts["counted"]
    with pytest.raises(ProcessError, match=r"run 3 of the compiled loop differs .* in steps"):
        _compare(replace(counted, steps=1999), asdict(counted), reporter)


# Teams that pass from cell to cell.

CLOCKS = (0.0015, -0.0015)
"""Errors of the robots' clocks [s]."""


def passing_team(at=0.7, **fault):
    """All that may depart from a passing team, words lost and late, and a fault of robot 0."""
    faults = {"silence": Silence(at, 0.5), "deaf": Deafness(at, 0.5)}
    own = {name: faults[name] for name in fault}
    return replace(
        EVERYTHING,
        mass_error=0.01,
        floor=Floor(coulomb_friction=0.2, viscous_friction=0.2, slope=0.0005),
        joint_friction=JointFriction(coulomb=0.01, viscous=0.01),
        measurements=Measurements(1e-4, 5e-5, 1e-3, 0.008, loss=0.1, late=0.2, late_by=0.012),
        robots={
            "robot_0": RobotDepartures(odometry_scale=0.01, clock_error=CLOCKS[0], switch_delay=0.01, **own),
            "robot_1": RobotDepartures(clock_error=CLOCKS[1]),
        },
        pushes=(),
        start_offset=StartOffset(),
    )  # fmt: skip


@cache
def prepared_motion(team="base"):
    scenario, plan = small_motion(team)
    return prepare(replace(scenario, deployment=at_200_hz()), plan, small_maps())


@pytest.mark.parametrize("fault", ["silence", "deaf"])
def test_a_team_that_passes_is_held_and_goes_on_at_every_sample_as_in_drake(fault):
    (scenario, plan), deployment = small_motion(), passing_team(**{fault: True})
    expected = simulate(replace(scenario, deployment=deployment), plan, small_maps())
    assert_moves_as(prepared_motion(), deployment, expected)
    outcome = run(prepared_motion(), deployment)
    assert_agree(outcome, expected)
    assert outcome.held == _times_held(expected, plan) == 1
    assert outcome.spread == pytest.approx(expected.governor_spread.max(), rel=0.5)


def test_a_team_that_passes_under_a_budget_agrees_with_drake_in_what_it_uses_and_what_monitors_say():
    """With clocks and time stamps that are wrong, too."""
    scenario, plan = motion_under_budget()
    transport, expected = prepare(scenario, plan, small_maps()), simulate(scenario, plan, small_maps())
    assert expected.reached
    assert_moves_as(transport, scenario.deployment, expected)
    outcome = run(transport, scenario.deployment)
    assert outcome.arrived, outcome.reason
    assert 0.02 < outcome.budget_share < 1.0
    # What counts is a rate, which Drake integrates to 1e-7 rad/s here, of 0.2 that are stated.
    assert outcome.budget_share == pytest.approx(budget_share(Rows(expected, plan)), rel=1e-5)


@pytest.mark.parametrize("fault", ["silence", "deaf"])
def test_a_team_stalls_whose_robot_stays_silent_or_deaf(fault):
    lasting = {"silence": Silence(0.6), "deaf": Deafness(0.6)}[fault]
    outcome = run(prepared_motion(), of_one(**{fault: lasting}))
    assert not outcome.arrived
    assert "stalled" in outcome.reason
    assert outcome.held == 1


def test_a_passing_team_is_held_by_the_scenario():
    scenario, plan = small_motion()
    held = replace(scenario, control=Control(hold=Hold(at=(0.6,), duration=1.0)), deployment=at_200_hz())
    transport, expected = prepare(held, plan, small_maps()), simulate(held, plan, small_maps())
    assert expected.reached
    assert_moves_as(transport, held.deployment, expected)
    outcome = run(transport)
    assert outcome.held == 1
    assert outcome.time > run(prepared_motion()).time + 1.0
