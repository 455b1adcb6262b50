"""Whatever departs, and however far: no team says that it has arrived away from its goal, but for biases.

The runs end when the supervisor says so, or after some time, and nothing of the world ends them before.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from coop_drake.compiled_loop import prepare, run
from coop_drake.scenario import (
    ActuatorLimits,
    BlockedWheels,
    Deployment,
    Floor,
    JointFriction,
    Measurements,
    Messages,
    PoseBias,
    Push,
    RobotDepartures,
    Silence,
    StartOffset,
    Wave,
    Waves,
    WheelSlip,
)
from coop_drake.simulation import build_maps, simulate
from tests.support.small_loop import small_maps, small_problem
from tests.support.tubes import WITH_AXES, tubed_problem
from tests.support.unwatched import run_unwatched

SECONDS = 6.0
SIZES = (1.0, 3.0, 10.0)


def of_one(**departures):
    return {"robots": {"robot_0": RobotDepartures(**departures)}}


def sampled(rate=200.0, **departures):
    return Deployment(control_rate=rate, **departures)


DEPARTURES = {
    "sampling": lambda size: sampled(200.0 / (2.0 * size)),
    "limits": lambda size: sampled(actuators=ActuatorLimits(base_force=30.0 / size)),
    "lag": lambda size: sampled(actuators=ActuatorLimits(lag=0.01 * size)),
    "model error": lambda size: sampled(mass_error=0.5 * size),
    "masses believed too small": lambda size: sampled(mass_error=-0.3 * size if size < 3.0 else -0.9),
    "noise": lambda size: sampled(measurements=Measurements(2e-3 * size, 1e-3 * size, 1e-2 * size)),
    "bounded errors of angles": lambda size: sampled(
        measurements=Measurements(waves=Waves(angle=Wave(5e-3 * size, 0.3), joints=Wave(5e-3 * size, 0.3)))
    ),
    "delay": lambda size: sampled(measurements=Measurements(delay=0.01 * size)),
    "lost measurements": lambda size: sampled(measurements=Measurements(1e-3, loss=1.0 - 0.5 / size)),
    "late measurements": lambda size: sampled(measurements=Measurements(late=0.8, late_by=0.02 * size)),
    "lost reports": lambda size: sampled(messages=Messages(loss=1.0 - 0.3 / size)),
    "late reports": lambda size: sampled(messages=Messages(delay=0.2 * size)),
    "repeated reports": lambda size: sampled(messages=Messages(repeat=1.0, delay=0.05 * size)),
    "odometry": lambda size: sampled(**of_one(odometry_scale=0.5 * size)),
    "clock": lambda size: sampled(**of_one(clock_error=0.05 * size)),
    "late switches": lambda size: sampled(**of_one(switch_delay=0.05 * size)),
    "silence": lambda size: sampled(**of_one(silence=Silence(0.3 * size))),
    "held motors": lambda size: sampled(**of_one(silence=Silence(0.5, 0.1 * size, "held"))),
    "limp motors": lambda size: sampled(**of_one(silence=Silence(0.5, 0.1 * size, "limp"))),
    "blocked wheels": lambda size: sampled(**of_one(blocked=BlockedWheels(0.3 * size))),
    "wheels that slip": lambda size: sampled(**of_one(slip=WheelSlip(0.5, 1.0 - 0.5 / size))),
    "Coulomb friction": lambda size: sampled(floor=Floor(coulomb_friction=20.0 * size)),
    "viscous friction": lambda size: sampled(floor=Floor(viscous_friction=50.0 * size)),
    "friction of joints": lambda size: sampled(joint_friction=JointFriction(1.0 * size, 0.5 * size)),
    "slope": lambda size: sampled(floor=Floor(slope=0.02 * size)),
    "push": lambda size: sampled(pushes=(Push("object", (50.0 * size, 20.0 * size), 1.0, 2.0),)),
    "start": lambda size: sampled(start_offset=StartOffset(0.02 * size, 0.0, 0.02 * size)),
}
"""Every line of docs/how_to/deployment.md but biases of the pose, by its size."""


@cache
def ideal():
    scenario, plan = small_problem("base")
    return prepare(replace(scenario, deployment=sampled()), plan, small_maps())


@cache
def budgeted():
    scenario, plan = tubed_problem(WITH_AXES, "base")
    return prepare(scenario, plan, build_maps(plan))


def off(transport, z):
    """How far a configuration is from the goal, over what is tolerated, [-]."""
    goal, allowed = transport.plan.goal_pose, transport.scenario.goal.tolerances
    return max(np.hypot(*(z[:2] - goal[:2])) / allowed.position, abs(z[2] - goal[2]) / allowed.angle)


@pytest.mark.slow
@pytest.mark.no_cover
@pytest.mark.parametrize("transport", [ideal, budgeted], ids=["no budget", "budget"])
@pytest.mark.parametrize("name", DEPARTURES)
def test_no_departure_ends_in_arrived_away_from_the_goal(name, transport):
    for size in SIZES:
        deployment = DEPARTURES[name](size)
        rate = transport().scenario.deployment.control_rate
        if transport is budgeted:
            if name in ("clock", "late switches"):
                return  # the compiled loop has one nominal motion for all robots, and refuses these
            deployment = replace(deployment, control_rate=rate)
        for seed in range(2):
            ended = run_unwatched(transport(), replace(deployment, seed=seed), SECONDS)
            assert not ended.arrived or off(transport(), ended.z) <= 1.0, (size, seed, ended)


def test_the_same_runs_without_departures_arrive():
    for transport in (ideal(), budgeted()):
        ended = run_unwatched(transport, transport.scenario.deployment, SECONDS)
        assert ended.arrived
        assert off(transport, ended.z) < 0.5
        assert run(transport).time == pytest.approx(ended.time)


def test_biases_that_differ_by_more_than_twice_the_tolerance_are_noticed_and_others_the_world_shows():
    allowed = ideal().scenario.goal.tolerances.position
    apart = {
        f"robot_{k}": RobotDepartures(PoseBias(x=side * 1.05 * allowed)) for k, side in ((0, 1), (1, -1))
    }
    assert not run_unwatched(ideal(), sampled(robots=apart), SECONDS).arrived
    alike = sampled(robots={"*": RobotDepartures(PoseBias(x=1.5 * allowed))})
    ended = run_unwatched(ideal(), alike, SECONDS)
    assert ended.arrived
    assert 1.0 < off(ideal(), ended.z) < 2.5
    outcome, said = run(ideal(), alike), "the team says that it has arrived"
    assert (outcome.arrived, outcome.time) == (False, pytest.approx(ended.time))
    assert said in outcome.reason
    log = simulate(replace(ideal().scenario, deployment=alike), ideal().plan, small_maps())
    assert not log.reached
    assert said in log.violation
    assert log.times[-1] == pytest.approx(ended.time)
