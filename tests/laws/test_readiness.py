"""Levels and margins: when a robot is ready, has arrived, asks for a hold and brakes."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest

from coop_drake.laws import Funnel, ScheduledGains, readiness, transition_gains
from coop_drake.laws.axis_table import ENERGY_BOUND, axis_table, track_row
from coop_drake.systems.kernels import ready_conditions
from tests.support.readiness import margin_of, square_with_clearance

PERIOD = 0.005

ROWS = 2 * readiness.mean_samples(PERIOD)

TIMES = PERIOD * np.arange(ROWS)

PLACE = np.array([1.0, 2.0, 0.5, 0.0])

EXACT = readiness.ArrivalGoal(PLACE, np.array([0.01, 0.02, np.inf]), np.zeros(3))

CERTIFIED = EXACT._replace(errors=np.array([0.003, 0.002, 0.002]))

NOISE = np.array([1e-3, 1e-3, 5e-4, 5e-4])


def margin(samples, goal=EXACT, turned=0):
    """Of samples from the oldest to the newest, kept in a ring that begins anywhere."""
    return readiness.arrival_margin(*goal, np.roll(samples, turned, axis=0), (ROWS - 1 + turned) % ROWS)


def at(*away):
    return np.tile(PLACE + np.array(away), (ROWS, 1))


@pytest.mark.parametrize("turned", [0, 7, ROWS - 1])
def test_at_rest_at_the_goal_it_has_arrived_wherever_the_ring_begins(turned):
    assert margin(at(0.0, 0.0, 0.0, 3.0), turned=turned) > 1.0 - 1e-9
    samples = at(0.0, 0.0, 0.0, 0.0)
    samples[: ROWS // 2, 0] += 0.05  # the older half elsewhere
    assert margin(samples, turned=turned) < 0.0


def test_it_measures_for_long_enough_first():
    samples = at(0.0, 0.0, 0.0, 0.0)
    samples[0] = np.inf
    assert margin(samples) == readiness.FAR


@pytest.mark.parametrize(
    ("goal", "allowed"), [(EXACT, (0.009, 0.018)), (CERTIFIED, (0.007, 0.018))], ids=["exact", "certified"]
)
def test_the_mean_lies_within_the_tolerance_less_its_certified_error(goal, allowed):
    place, angle = allowed
    for share, arrived in ((0.999, True), (1.001, False)):
        assert (margin(at(0.6 * share * place, 0.8 * share * place, 0.0, 0.0), goal) >= 0.0) == arrived
        assert (margin(at(0.0, 0.0, -share * angle, 0.0), goal) >= 0.0) == arrived
    assert margin(at(0.0, 0.0, 0.0, 5.0), goal) > 1.0 - 1e-9  # the joint is free


@pytest.mark.parametrize(("column", "speed"), [(0, 0.01), (2, 0.02), (3, 0.02)])
def test_what_moves_has_not_arrived(column, speed):
    for share, arrived in ((0.9, True), (3.0, False)):
        samples = at(0.0, 0.0, 0.0, 0.0)
        samples[:, column] += share * speed * (TIMES - TIMES[ROWS // 2])
        assert (margin(samples) >= 0.0) == arrived


@pytest.mark.parametrize("size", [0.015, 0.03])
def test_what_moves_to_and_fro_through_the_goal_has_not_arrived_at_any_moment(size):
    for frequency in np.arange(0.5, 25.0, 0.25):
        for phase in np.linspace(0.0, 2.0 * np.pi, 24):
            samples = at(0.0, 0.0, 0.0, 0.0)
            samples[:, 0] += size * np.sin(2.0 * np.pi * frequency * TIMES + phase)
            # Slower than this, the turning point is rest for as long as a robot looks.
            away = abs(samples[ROWS // 2 :, 0].mean() - PLACE[0])
            assert margin(samples) < 0.0, (frequency, phase, away)


def test_noise_does_not_keep_it_from_arriving_and_does_not_let_it_arrive_elsewhere():
    generator = np.random.default_rng(0)
    said = {}
    for away, scale in ((0.0, 1.0), (0.012, 1.0), (0.012, 5.0), (0.03, 10.0)):
        samples = at(away, 0.0, 0.0, 0.0) + scale * NOISE * generator.normal(size=(2000, ROWS, 4))
        said[away, scale] = np.mean([margin(one) >= 0.0 for one in samples])
    assert said[0.0, 1.0] > 0.99
    assert said[0.012, 1.0] == 0.0
    assert said[0.012, 5.0] < 1e-3
    assert said[0.03, 10.0] == 0.0


def test_a_certified_error_that_jumps_does_not_keep_it_from_arriving_for_ever():
    goal = CERTIFIED._replace(errors=np.array([0.0024, 0.0015, 0.0015]))
    arrived = 0
    for phase in np.linspace(0.0, 1.0, 60):
        samples = at(0.0, 0.0, 0.0, 0.0)
        samples += np.outer(np.where((TIMES / 0.3 + phase) % 1.0 < 0.5, 1.0, -1.0), goal.errors[[0, 0, 1, 2]])
        arrived += margin(samples, goal) >= 0.0
    assert arrived > 20


def test_a_monitor_asks_above_its_level_and_a_little_longer_and_brakes_above_twice_the_level():
    long_ago = -1e9
    assert readiness.alarm_at(1.0, 5.0, long_ago) == readiness.QUIET
    assert readiness.alarm_at(1.001, 5.0, long_ago) == readiness.ASKS
    assert readiness.alarm_at(0.0, 5.0, 5.0 - 0.5 * readiness.QUIET_TIME) == readiness.ASKS
    assert readiness.alarm_at(0.0, 5.0, 5.0 - 1.1 * readiness.QUIET_TIME) == readiness.QUIET
    assert readiness.alarm_at(2.001, 5.0, long_ago) == readiness.BRAKES
    assert readiness.alarm_at(inf, 5.0, long_ago) == readiness.BRAKES


def test_levels_have_names():
    names = [readiness.departing_name(check, ("shoulder", "elbow")) for check in range(14)]
    assert names[:6] == [
        "the object's position", "the object's velocity", "its grasp", "the angle of its base",
        "where the object goes", "the object's angle",
    ]  # fmt: skip
    axes = names[5:8]
    assert axes[1:] == ["shoulder", "elbow"]
    assert names[8:] == [*(f"the rate of {n}" for n in axes), *(f"where {n} goes" for n in axes)]


GOAL = {"goal_lower": np.array([0.8, -0.2]), "goal_upper": np.array([1.0, 0.2])}

INTERVALS = {"slice_lower": np.array([0.0, -1.0]), "slice_upper": np.array([1.0, 1.0]), **GOAL}


NEXT_INTERVALS = {
    "slice_lower": np.array([0.8, -0.2]),
    "slice_upper": np.array([1.8, 1.0]),
    "goal_lower": np.array([1.6, 0.6]),
    "goal_upper": np.array([1.8, 1.0]),
}


def table_of(intervals, resting):
    gains = transition_gains(ScheduledGains(), clearance=0.2, resting=np.array(resting), **intervals)
    return axis_table(Funnel(**intervals, decay_rate=gains.decay_rate, shape=gains.funnel), gains), gains


TABLE, _ = table_of(INTERVALS, [0.4, 0.5])

NEXT_TABLE, NEXT_GAINS = table_of(NEXT_INTERVALS, [0.9, 0.0])

ROW = NEXT_GAINS.governor_row(replace(NEXT_GAINS, stiffness=90.0))


AT_REST = {
    "position": [3.0, 1.0],
    "velocity": [0.0, 0.0],
    "governor_position": [3.0, 1.0],
    "axes": [0.9, 0.0],
    "rates": [0.0, 0.0],
}


def ready(next_clearance=0.3, inradius=0.3, **change):
    state = {**AT_REST, **change}
    edges = square_with_clearance(state["governor_position"], next_clearance)
    conditions = ready_conditions(
        [TABLE, NEXT_TABLE], [edges, edges], [ROW, ROW], [inradius, 0.1], np.zeros(2), 0.01
    )
    return margin_of(conditions[0], **state)


def test_the_next_cell_is_judged_by_the_stiffness_that_it_is_entered_with():
    """With K = 90 and d = 0.02 m there is room for 0.164 m/s, whatever the cell's own K of 100."""
    assert NEXT_GAINS.stiffness == 100.0
    assert ready(next_clearance=0.02, inradius=0.02) > 0.0
    assert ready(next_clearance=0.02, inradius=0.02, velocity=[0.166, 0.0]) < 0.0
    assert ready(next_clearance=0.02, inradius=0.02, velocity=[0.162, 0.0]) > 0.0


def test_a_robot_is_ready_only_once_the_last_hand_over_is_over():
    assert ready(time=NEXT_GAINS.hand_over_time) >= 0.0
    assert ready(time=0.9 * NEXT_GAINS.hand_over_time) < 0.0


@pytest.mark.parametrize(
    "change",
    [
        {"axes": [0.815, 0.0]},
        {"axes": [0.9, 0.19]},
        {"rates": [0.0, -1.0]},
        {"rates": [1.0, 0.0]},
        {"velocity": [4.0, 0.0]},
        {"position": [3.29, 1.0]},
        {"next_clearance": 0.1},
        {"next_clearance": -0.3},
    ],
)
def test_a_robot_at_rest_in_the_middle_of_the_goal_is_ready_unless_one_condition_fails(change):
    assert ready() > 0.0 > ready(**change)


def test_margins_by_hand():
    """Intervals count less a tenth of their width, clearance from half the inradius, energy to its bound."""
    assert readiness.interval_margin(0.5, 0.0, 1.0) == 1.0
    assert readiness.interval_margin(0.1, 0.0, 1.0) == pytest.approx(0.0, abs=1e-15)
    assert readiness.interval_margin(0.9, -1.0, 1.0) < 0.0
    assert readiness.interval_margin(0.9, -1.0, 1.0, 0.0) == pytest.approx(0.1)
    floor = 0.5 * 100.0 * 0.15**2
    assert [readiness.clearance_margin(share * floor, 100.0, 0.3) for share in (1.0, 2.0, -1.0)] == [
        0.0, pytest.approx(0.5), pytest.approx(-2.0)
    ]  # fmt: skip
    energy, following = track_row(NEXT_TABLE[0], 0.0, 0.85, 0.05)[1], NEXT_TABLE[0].copy()
    for share, margin in ((1.0, 0.0), (2.0, 0.5), (0.5, -0.5)):
        following[ENERGY_BOUND] = share * energy
        assert readiness.axis_ready(TABLE[0], following, 0.85, 0.05)[1] == pytest.approx(margin)


def arrival(position=(5.0, 8.004), velocity=(0.0, 0.004), axes=(4.66, 0.3), rates=(0.01, 0.0)):
    """The margin in the last cell, whose goal is (5, 8) and 4.663 rad."""
    intervals = {
        "slice_lower": np.array([4.0, -1.0]),
        "slice_upper": np.array([5.0, 1.0]),
        "goal_lower": np.array([4.643, -1.0]),
        "goal_upper": np.array([4.683, 1.0]),
    }
    table, gains = table_of(intervals, [4.5, 0.0])
    goal = np.array([5.0, 8.0])
    edges, row = square_with_clearance(goal, 0.3), gains.governor_row(gains)
    conditions = ready_conditions([table], [edges], [row], [0.3], goal, 0.01)
    return margin_of(conditions[0], position, velocity, goal, axes, rates)


@pytest.mark.parametrize(
    "change",
    [
        {"position": [5.0, 8.0095]},
        {"velocity": [0.0, 0.011]},
        {"axes": [4.644, 0.3]},
        {"rates": [0.01, -0.03]},
    ],
)
def test_arrival_needs_place_angle_and_rest_and_each_alone_delays_it(change):
    assert arrival() > 0.0 > arrival(**change)
