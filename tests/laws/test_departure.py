"""Levels of departures: how long nobody knows of one, what it grows by, when a monitor asks and brakes."""

from math import inf

import pytest

from coop_drake.laws.readiness import (
    ASKS,
    BRAKES,
    QUIET,
    QUIET_TIME,
    alarm_at,
    axis_level,
    departing_name,
    growth,
    quiet_margin,
    unseen_time,
)


def test_a_departure_is_unseen_for_delay_report_and_one_period_in_whole_periods():
    assert unseen_time(0.01, 0.025, 0.005, 0.0) == pytest.approx(0.04)
    assert unseen_time(0.011, 0.0, 0.005, 0.0) == pytest.approx(0.02)
    assert unseen_time(0.011, 0.0, 0.005, 0.001) == pytest.approx(0.021)  # what clocks hide of the age
    assert growth(0.04, 0.2, 0.04) == pytest.approx(0.0016 + 0.00016)


def test_the_level_of_an_axis_is_the_stated_one_or_what_its_room_leaves():
    assert axis_level(0.02, 0.005, 0.0, -0.1, 0.1) == 0.02
    assert axis_level(0.02, 0.005, 0.09, -0.1, 0.1) == pytest.approx(0.005)
    assert axis_level(0.02, 0.005, -0.09, -0.1, 0.1) == pytest.approx(0.005)


def test_a_monitor_asks_above_its_level_and_a_little_longer_and_brakes_above_twice_the_level():
    long_ago = -1e9
    assert alarm_at(1.0, 5.0, long_ago) == QUIET
    assert alarm_at(1.001, 5.0, long_ago) == ASKS
    assert alarm_at(0.0, 5.0, 5.0 - 0.5 * QUIET_TIME) == ASKS
    assert alarm_at(0.0, 5.0, 5.0 - 1.1 * QUIET_TIME) == QUIET
    assert alarm_at(2.001, 5.0, long_ago) == BRAKES
    assert alarm_at(inf, 5.0, long_ago) == BRAKES


def test_no_robot_is_ready_while_its_monitor_is_not_quiet():
    assert quiet_margin(0.3, QUIET) == 0.3
    assert quiet_margin(0.3, ASKS) == quiet_margin(0.3, BRAKES) == -1.0
    assert quiet_margin(-2.0, ASKS) == -2.0


def test_levels_have_names():
    names = [departing_name(check, ("shoulder", "elbow")) for check in range(11)]
    assert names[:6] == [
        "the object's position", "the object's velocity", "its grasp", "the angle of its base",
        "where the object goes", "the object's angle",
    ]  # fmt: skip
    assert names[6:] == ["shoulder", "elbow", *[f"the rate of {n}" for n in (names[5], "shoulder", "elbow")]]
