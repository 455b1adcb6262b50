"""Quick turns, whose centrifugal forces the law of the axes bears."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from shapely import box

from coop_drake.answers.plan import Cell
from coop_drake.laws import ScheduledGains
from coop_drake.scenario import Deployment, Start
from coop_drake.simulation import build_maps, simulate
from coop_drake.typed_data import convert_class
from tests.support.small_loop import joint_names
from tests.support.small_plan import START_POSE, plan_by_hand
from tests.support.small_scenario import small_scenario

ARMS = {"robot_0": (-0.05, 0.22), "robot_1": (0.45, -0.95)}
"""The second robot's arm is bent as in the cell of `elbow` in which the object turns quickest."""


def deployed(**changes):
    return convert_class(Deployment.completed({"preset": "mobile_base", **changes}), Deployment)


HALF_WIDTH = 0.03


def turning_plan(names, gain_set):
    """Two turns of 0.6 rad in one place, with 60 mrad for every joint."""
    room, arms = box(2.0, 2.0, 4.4, 4.4), np.concatenate([*ARMS.values()])
    cells = tuple(
        Cell(np.array([lower, *(arms - HALF_WIDTH)]), np.array([upper, *(arms + HALF_WIDTH)]), room)
        for lower, upper in ((-0.46, 0.26), (-1.12, -0.40))
    )
    start = np.array([*START_POSE, *arms])
    return plan_by_hand(cells, start, np.array([3.2, 3.2, -1.04]), names, gain_set)


@cache
def maps():
    return build_maps(turning_plan(("a", "b", "c", "d"), ScheduledGains()))


def turned(mass_error, **rule):
    deployment, scenario = deployed(mass_error=mass_error), small_scenario("elbow")
    gains = ScheduledGains(**rule).for_age(deployment.command_age)
    plan = turning_plan(joint_names(scenario), gains)
    start = Start(scenario.start.object, ARMS)
    return simulate(replace(scenario, start=start, deployment=deployment), plan, maps())


@pytest.mark.parametrize("mass_error", [-0.2, 0.2])
def test_a_turn_as_quick_as_joints_bear_arrives(mass_error):
    log = turned(mass_error)
    assert (log.reached, log.violation) == (True, "")
    assert log.funnel_margin.min() > 0.002


def test_a_quicker_turn_is_lost():
    assert "robot_1::shoulder to its funnel" in turned(-0.2, turning_acceleration=1e3).violation
