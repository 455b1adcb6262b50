import numpy as np
import pytest

from coop_drake.laws import Funnel, ScheduledGains, arrival_margin, ready_margin, transition_gains
from coop_drake.laws.ready import clearance_margin, funnel_margin, interval_margin

GOAL = {"goal_lower": np.array([0.8, -0.2]), "goal_upper": np.array([1.0, 0.2])}
NEXT_INTERVALS = {
    "slice_lower": np.array([0.8, -0.2]),
    "slice_upper": np.array([1.8, 1.0]),
    "goal_lower": np.array([1.6, 0.6]),
    "goal_upper": np.array([1.8, 1.0]),
}
NEXT_GAINS = transition_gains(ScheduledGains(), neck=0.2, resting=np.array([0.9, 0.0]), **NEXT_INTERVALS)
NEXT_FUNNEL = Funnel(**NEXT_INTERVALS, decay_rate=NEXT_GAINS.decay_rate, shape=NEXT_GAINS.funnel)
AT_REST = {
    "position": np.array([3.0, 1.0]),
    "velocity": np.zeros(2),
    "governor_position": np.array([3.0, 1.0]),
    "next_clearance": 0.3,
    "inradius": 0.3,
    "axis_position": np.array([0.9, 0.0]),
    "axis_rate": np.zeros(2),
    "next_funnel": NEXT_FUNNEL,
    "next_gains": NEXT_GAINS,
    **GOAL,
}


def test_a_robot_at_rest_in_the_middle_of_the_goal_is_ready():
    assert ready_margin(**AT_REST) > 0.0


@pytest.mark.parametrize(
    "change",
    [
        {"axis_position": np.array([0.815, 0.0])},
        {"axis_position": np.array([0.9, 0.19])},
        {"axis_rate": np.array([0.0, -1.0])},
        {"axis_rate": np.array([1.0, 0.0])},
        {"velocity": np.array([4.0, 0.0])},
        {"position": np.array([3.29, 1.0])},
        {"next_clearance": 0.1},
        {"next_clearance": -0.3},
    ],
)
def test_every_condition_alone_keeps_a_robot_from_being_ready(change):
    assert ready_margin(**{**AT_REST, **change}) < 0.0


def test_intervals_are_eroded_by_a_tenth_of_their_width():
    lower, upper = np.array([0.0, -1.0]), np.array([1.0, 1.0])
    assert interval_margin(np.array([0.5, 0.0]), lower, upper) == 1.0
    assert interval_margin(np.array([0.1, 0.0]), lower, upper) == pytest.approx(0.0, abs=1e-15)
    assert interval_margin(np.array([0.5, 0.9]), lower, upper) < 0.0
    assert interval_margin(np.array([0.5, 0.9]), lower, upper, erosion=0.0) == pytest.approx(0.1)


def test_clearance_counts_from_half_the_inradius():
    floor = 0.5 * 100.0 * 0.15**2
    assert clearance_margin(floor, stiffness=100.0, inradius=0.3) == 0.0
    assert clearance_margin(2.0 * floor, stiffness=100.0, inradius=0.3) == pytest.approx(0.5)
    assert clearance_margin(-floor, stiffness=100.0, inradius=0.3) == pytest.approx(-2.0)


def test_the_next_cell_is_judged_by_its_own_stiffness():
    """With K = 100 and d = 0.02 m there is room for 0.17 m/s, whatever the present stiffness."""
    slow = {**AT_REST, "next_clearance": 0.02, "inradius": 0.02}
    assert ready_margin(**slow) > 0.0
    assert NEXT_GAINS.stiffness == 100.0
    assert ready_margin(**{**slow, "velocity": np.array([0.18, 0.0])}) < 0.0
    assert ready_margin(**{**slow, "velocity": np.array([0.17, 0.0])}) > 0.0


def test_the_funnel_margin_vanishes_at_the_energy_bound():
    rate = np.array([np.sqrt(2.0 * NEXT_GAINS.energy_bound[0]), 0.0])
    middle = 0.5 * (NEXT_INTERVALS["slice_lower"] + NEXT_INTERVALS["slice_upper"])
    assert funnel_margin(middle, rate, funnel=NEXT_FUNNEL, gains=NEXT_GAINS) == pytest.approx(0.0, abs=1e-12)
    assert funnel_margin(middle, 0.9 * rate, funnel=NEXT_FUNNEL, gains=NEXT_GAINS) > 0.0


ARRIVED = {
    "position": np.array([5.0, 8.004]),
    "velocity": np.array([0.0, 0.004]),
    "target": np.array([5.0, 8.0]),
    "axis_position": np.array([4.66, 0.3]),
    "axis_rate": np.array([0.01, 0.0]),
    "goal_lower": np.array([4.643, -1.0]),
    "goal_upper": np.array([4.683, 1.0]),
    "position_tolerance": 0.01,
}


def test_arrival_needs_place_angle_and_rest():
    assert arrival_margin(**ARRIVED) > 0.0


@pytest.mark.parametrize(
    "change",
    [
        {"position": np.array([5.0, 8.0095])},
        {"velocity": np.array([0.0, 0.011])},
        {"axis_position": np.array([4.644, 0.3])},
        {"axis_rate": np.array([0.01, -0.03])},
    ],
)
def test_every_condition_alone_delays_arrival(change):
    assert arrival_margin(**{**ARRIVED, **change}) < 0.0
