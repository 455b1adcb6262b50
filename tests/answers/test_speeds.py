"""Peaks of bases and joints are those of the log, beside the limits that are known."""

from dataclasses import replace

import numpy as np
import pytest

from coop_drake.answers.speeds import SHORTEST, base_speeds, peak_speeds, steadiness
from coop_drake.plant import planning_problem
from coop_drake.simulation import simulate
from tests.support.small_loop import small_maps, small_problem


@pytest.fixture(scope="module")
def run():
    scenario, plan = small_problem()
    return planning_problem(scenario), simulate(scenario, plan, small_maps())


def test_a_base_that_turns_at_a_constant_speed_has_that_speed(run):
    _, log = run
    angle = 2.0 * log.times + 3.0  # through half a turn, where the stated angle jumps
    poses = np.stack([0.3 * log.times, 0.4 * log.times, np.arctan2(np.sin(angle), np.cos(angle))], axis=-1)
    steady = replace(log, base_poses=np.repeat(poses[:, None], len(log.robot_names), axis=1))
    times, speeds = base_speeds(steady)
    np.testing.assert_allclose(speeds[..., 0], 0.5, rtol=1e-9)
    np.testing.assert_allclose(speeds[..., 1], 2.0, rtol=1e-9)
    assert np.diff(times).min() >= SHORTEST


def test_near_stops_and_slow_times_are_those_between_start_and_goal(run):
    """A speed of 1 - cos(2 pi t), 1 m/s in the mean: at rest at both ends and three times on the way."""
    _, log = run
    times = np.linspace(0.0, 4.0, len(log.times))
    speed = 1.0 - np.cos(2.0 * np.pi * times)
    poses = np.zeros((len(times), 3))
    poses[:, 0] = times - np.sin(2.0 * np.pi * times) / (2.0 * np.pi)
    twist = np.stack([speed, 0.0 * speed, 0.0 * speed], axis=-1)
    stops, slow = steadiness(replace(log, times=times, object_pose=poses, object_twist=twist))
    assert stops == 3
    assert slow == pytest.approx(4.0 * np.arccos(0.75) / np.pi, abs=0.03)


def test_every_base_and_joint_has_its_peak_and_limit(run):
    problem, log = run
    limits = replace(problem.limits, base_speeds=np.array([0.9, np.inf]), joint_rates=np.array([np.inf, 2.0]))
    peaks = {speed.name: speed for speed in peak_speeds(log, replace(problem, limits=limits))}
    assert list(peaks) == [
        "speed of robot_0", "turn rate of robot_0", "speed of robot_1", "turn rate of robot_1",
        "rate of robot_0::elbow", "rate of robot_1::elbow",
    ]  # fmt: skip
    assert (peaks["speed of robot_0"].limit, peaks["speed of robot_1"].limit) == (0.9, None)
    assert peaks["rate of robot_1::elbow"].peak == np.abs(log.joint_rates[:, 1]).max()
    assert [peaks[name].unit for name in ("speed of robot_0", "turn rate of robot_0")] == ["m/s", "rad/s"]
    lever = 1.2  # of the object's angle, at most
    fastest = np.hypot(*log.object_twist[:, :2].T).max() + lever * np.abs(log.object_twist[:, 2]).max()
    assert 0.3 < peaks["speed of robot_0"].peak < fastest + np.abs(log.joint_rates).max()
