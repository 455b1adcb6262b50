"""Teams that do not ship: the law stays exact for any object and any arm."""

import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder

from coop_drake.plant import build_team_plant
from coop_drake.plant.model_writing import polygon_body_files, write_polygon_body
from coop_drake.scenario import load_scenario
from coop_drake.simulation import simulate
from tests.support.edited_scenario import write_edited, write_with_robot
from tests.support.robot_models import Arm
from tests.support.run_checks import verified_run
from tests.support.small_loop import joint_names, small_maps
from tests.support.small_plan import small_plan
from tests.support.small_scenario import in_open_room

SLIDING = Arm(
    joints=(
        ("prismatic", "1 0 0", "<limit><lower>-0.7</lower><upper>0.7</upper></limit>"),
        ("revolute", "0 0 1", ""),
    )
)
UPSIDE_DOWN = Arm(joints=(("revolute", "0 0 1", ""), ("revolute", "0 0 1", "")), roll=3.141592653589793)
DAMPED = Arm(
    joints=(
        (
            "revolute",
            "0 0 1",
            "<limit><lower>-1</lower><upper>1</upper></limit><dynamics><damping>2</damping></dynamics>",
        ),
    )
)
ANGLE_IRON = ((-0.4, -0.25), (0.4, -0.25), (0.4, 0.0), (-0.1, 0.0), (-0.1, 0.35), (-0.4, 0.35))


def run(path):
    scenario = in_open_room(load_scenario(path))
    return scenario, simulate(scenario, small_plan(joint_names(scenario)), small_maps())


def assert_exact_arrival(log):
    assert log.violation == ""
    assert log.reached
    largest = np.abs(np.gradient(log.object_twist, log.times, axis=0)).max()
    assert log.acceleration_error.max() <= 1e-12 * max(1.0, largest)
    assert log.wrench_error.max() <= 1e-10
    assert log.governor_spread.max() == 0.0
    assert log.energy_margin.min() >= 0.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arm", "start"),
    [(SLIDING, "[0.0, 0.0]"), (UPSIDE_DOWN, "[0.0, 0.0]"), (DAMPED, "[0.0]"), (Arm(joints=()), "[]")],
    ids=["sliding", "upside-down", "damped", "no-joints"],
)
def test_a_team_of_unlike_robots(tmp_path, arm, start):
    path = write_with_robot(tmp_path, arm.text(), "sdf", ("robot_0: [0.0]", f"robot_0: {start}"))
    scenario, log = run(path)
    assert_exact_arrival(log)
    assert verified_run(scenario, small_plan(joint_names(scenario)), log).answer == "arrived"
    assert len(log.joint_names) == 1 + len(arm.joints)


def test_an_object_whose_centre_of_mass_is_off_its_origin(tmp_path):
    grasps = [(0.4, -0.15, 0.0), (-0.4, 0.2, 3.14159265358979)]
    write_polygon_body(polygon_body_files(ANGLE_IRON, 7.0, "angle_iron", grasps=grasps), tmp_path)
    path = write_edited(tmp_path, ("package://coop_drake_models/object.sdf", "angle_iron.sdf"))
    scenario, log = run(path)
    inertia = build_team_plant(scenario, DiagramBuilder()).object_inertia
    assert abs(inertia.p_LLcm).max() > 0.05
    assert_exact_arrival(log)


def test_robots_that_share_the_load_unequally(tmp_path):
    path = write_edited(
        tmp_path, ("object: object\n", "object: object\nload_shares: {robot_0: 0.8, robot_1: 0.2}\n")
    )
    _, log = run(path)
    assert_exact_arrival(log)
    first, second = log.measured_wrenches[:, 0, :2], log.measured_wrenches[:, 1, :2]
    assert abs(first).max() > 1.0
    assert first == pytest.approx(4.0 * second, abs=1e-8)
