from dataclasses import replace

import numpy as np
import pytest

from coop_drake.laws import Funnel, ScheduledGains, transition_gains
from coop_drake.laws.axis_table import axis_table
from coop_drake.laws.gains import RestCondition
from coop_drake.laws.readiness import axis_ready, clearance_margin, funnel_margin, interval_margin
from coop_drake.systems.kernels import ready_conditions
from tests.support.readiness import margin_of, square_with_clearance

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


def test_a_robot_at_rest_in_the_middle_of_the_goal_is_ready():
    assert ready() > 0.0


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
def test_every_condition_alone_keeps_a_robot_from_being_ready(change):
    assert ready(**change) < 0.0


def test_intervals_are_eroded_by_a_tenth_of_their_width():
    assert interval_margin(0.5, 0.0, 1.0) == 1.0
    assert interval_margin(0.1, 0.0, 1.0) == pytest.approx(0.0, abs=1e-15)
    assert interval_margin(0.9, -1.0, 1.0) < 0.0
    assert interval_margin(0.9, -1.0, 1.0, 0.0) == pytest.approx(0.1)


def test_clearance_counts_from_half_the_inradius():
    floor = 0.5 * 100.0 * 0.15**2
    assert clearance_margin(floor, 100.0, 0.3) == 0.0
    assert clearance_margin(2.0 * floor, 100.0, 0.3) == pytest.approx(0.5)
    assert clearance_margin(-floor, 100.0, 0.3) == pytest.approx(-2.0)


def test_the_next_cell_is_judged_by_the_stiffness_that_it_is_entered_with():
    """With K = 90 and d = 0.02 m there is room for 0.164 m/s, whatever the cell's own K of 100."""
    assert NEXT_GAINS.stiffness == 100.0
    assert ready(next_clearance=0.02, inradius=0.02) > 0.0
    assert ready(next_clearance=0.02, inradius=0.02, velocity=[0.166, 0.0]) < 0.0
    assert ready(next_clearance=0.02, inradius=0.02, velocity=[0.162, 0.0]) > 0.0


def test_a_robot_is_ready_only_once_the_last_hand_over_is_over():
    assert ready(time=NEXT_GAINS.hand_over_time) >= 0.0
    assert ready(time=0.9 * NEXT_GAINS.hand_over_time) < 0.0


def test_the_funnel_margin_vanishes_at_the_energy_bound():
    assert funnel_margin(0.3, 0.3) == 0.0
    assert funnel_margin(0.0, 0.3) == 1.0
    assert funnel_margin(0.6, 0.3) == pytest.approx(-0.5)


def test_a_cell_that_is_left_at_rest_asks_for_place_and_rate_in_place_of_the_energy():
    gains = transition_gains(ScheduledGains(), clearance=0.2, resting=np.array([0.4, 0.5]), **INTERVALS)
    gains = replace(gains, rest=RestCondition(0.5, np.array([0.05, 0.1]), np.array([0.2, 0.3])))
    funnel = Funnel(**INTERVALS, decay_rate=gains.decay_rate, shape=gains.funnel)
    table, alone = (
        axis_table(funnel, gains),
        axis_table(funnel.select(np.array([1])), gains.select(np.array([1]))),
    )
    assert axis_ready(table[0], NEXT_TABLE[0], 0.9, 0.05) == pytest.approx(0.75)
    assert axis_ready(table[0], NEXT_TABLE[0], 0.88, 0.05) == pytest.approx(0.6)
    assert axis_ready(table[0], NEXT_TABLE[0], 0.96, 0.0) < 0.0
    assert axis_ready(table[0], NEXT_TABLE[0], 0.9, -0.21) < 0.0
    assert axis_ready(alone[0], NEXT_TABLE[1], 0.0, 0.15) == pytest.approx(0.5)


ARRIVED = {
    "position": [5.0, 8.004],
    "velocity": [0.0, 0.004],
    "governor_position": [5.0, 8.0],
    "axes": [4.66, 0.3],
    "rates": [0.01, 0.0],
}


def arrival(**change):
    intervals = {
        "slice_lower": np.array([4.0, -1.0]),
        "slice_upper": np.array([5.0, 1.0]),
        "goal_lower": np.array([4.643, -1.0]),
        "goal_upper": np.array([4.683, 1.0]),
    }
    table, gains = table_of(intervals, [4.5, 0.0])
    edges = square_with_clearance([5.0, 8.0], 0.3)
    conditions = ready_conditions(
        [table], [edges], [gains.governor_row(gains)], [0.3], np.array([5.0, 8.0]), 0.01
    )
    return margin_of(conditions[0], **{**ARRIVED, **change})


def test_arrival_needs_place_angle_and_rest():
    assert arrival() > 0.0


@pytest.mark.parametrize(
    "change",
    [
        {"position": [5.0, 8.0095]},
        {"velocity": [0.0, 0.011]},
        {"axes": [4.644, 0.3]},
        {"rates": [0.01, -0.03]},
    ],
)
def test_every_condition_alone_delays_arrival(change):
    assert arrival(**change) < 0.0
