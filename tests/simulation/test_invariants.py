from dataclasses import replace

import numpy as np
import pytest

from coop_drake.simulation import Invariants, TeamClearance
from coop_drake.simulation.telemetry import Sample
from tests.support.cases import team_tree
from tests.support.small_plan import ROOM, small_plan

PLAN = small_plan(("robot_0::joint_1", "robot_1::joint_1"))
Z = PLAN.start
GOOD = Sample(
    time=1.25,
    cell=0,
    entry=0.5,
    z=Z,
    rates=np.zeros(5),
    accelerations=np.zeros(5),
    base_poses=np.zeros((2, 3)),
    governor_position=Z[:2],
    governor_spread=0.0,
    funnel_lower=np.array([0.1, -0.2, -0.2]),
    funnel_upper=np.array([0.3, 0.2, 0.25]),
    energy_margin=0.4,
    object_wrench=np.zeros(3),
    commanded_wrenches=np.ones((2, 3)),
    measured_wrenches=np.ones((2, 3)),
    grasp_error=0.0,
    base_wrenches=np.zeros((2, 3)),
    joint_torques=np.zeros(2),
    acceleration_error=1e-12,
    ready_margins=np.zeros(2),
    held=0.0,
    clock_lag=0.0,
    causes=np.zeros(0),
    alarms=np.zeros((0, 3)),
    arrived=False,
)


@pytest.fixture(scope="module")
def invariants():
    return Invariants(TeamClearance(ROOM, team_tree(2, 1)), PLAN)


def test_a_good_sample_has_positive_margins_and_no_violation(invariants):
    margins = invariants.check(GOOD)
    assert margins.violation == ""
    assert margins.workspace_clearance > 0.0
    assert margins.body_clearance > 0.0
    assert margins.cell_clearance == pytest.approx(0.8)
    assert margins.funnel_margin == pytest.approx(0.1)
    assert margins.slice_margin == pytest.approx(0.2)
    assert margins.energy_margin == 0.4
    assert margins.acceleration_error == 1e-12
    assert margins.wrench_error == 0.0


def moved(index, value):
    z = Z.copy()
    z[index] = value
    return z


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"z": moved(0, 1.0)}, "clearance between robot_1::base and the walls is -"),
        ({"z": moved(3, 3.1)}, "clearance between "),
        ({"z": moved(1, 4.7)}, "distance of the object to the boundary of cell 0 is -0.1 m"),
        ({"z": moved(2, 0.32)}, "distance of object angle to its funnel is -0.02 rad or m"),
        ({"z": moved(4, 0.26)}, "distance of robot_1::joint_1 to its funnel is -0.01 rad or m"),
        ({"z": moved(3, -0.35)}, "distance of robot_0::joint_1 to its slice is -0.05 rad or m"),
        ({"grasp_error": 2e-4}, "distance of an end effector to its grasp is 0.0002 m"),
        ({"energy_margin": -1e-3}, "Delta E is -0.001 m^2/s^2"),
        ({"acceleration_error": 2e-9}, "realised less commanded acceleration is 2e-09 m/s^2"),
        ({"measured_wrenches": np.full((2, 3), 1.001)}, "measured less commanded grasp wrench is 0.001 N"),
        ({"acceleration_error": np.nan}, "realised less commanded acceleration is nan m/s^2"),
    ],
)
def test_each_broken_invariant_is_named_with_time_cell_and_amount(invariants, change, message):
    violation = invariants.check(replace(GOOD, **change)).violation
    assert violation.startswith("at t = 1.25 s in cell 0: ")
    assert message in violation


def test_an_axis_on_its_funnel_is_a_violation(invariants):
    assert "to its funnel is 0 rad" in invariants.check(replace(GOOD, z=moved(4, 0.25))).violation


def test_no_energy_left_is_no_violation(invariants):
    assert invariants.check(replace(GOOD, energy_margin=0.0)).violation == ""
