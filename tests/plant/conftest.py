import pytest

from coop_drake.scenario import load_scenario
from tests.support.edited_scenario import shipped, team_of, write_with_robot
from tests.support.robot_models import Arm, urdf_arm

PI = 3.141592653589793
SLIDE = "<limit><lower>-0.05</lower><upper>0.2</upper></limit>"
OTHERS = {
    "plain arm": (Arm().text(), "sdf", 1),
    "axis down": (Arm(joints=(("revolute", "0 0 -1", ""),)).text(), "sdf", 1),
    "joint upside down": (Arm(roll=PI).text(), "sdf", 1),
    "three joints": (
        Arm(joints=(("revolute", "0 0 1", ""), ("revolute", "0 0 -1", ""), ("revolute", "0 0 1", ""))).text(),
        "sdf",
        3,
    ),
    "slanted slide": (
        Arm(joints=(("revolute", "0 0 1", ""), ("prismatic", "1 0.5 0", SLIDE))).text(),
        "sdf",
        2,
    ),
    "slide upside down": (Arm(joints=(("prismatic", "1 0.2 0", SLIDE),), roll=PI).text(), "sdf", 1),
    "urdf": (urdf_arm(), "urdf", 2),
}
TEAMS = ("base", "elbow", "three", *OTHERS)


@pytest.fixture(params=TEAMS)
def scenario(request, tmp_path):
    """Teams of every kind: shipped ones, and the base scenario with another first robot."""
    if request.param not in OTHERS:
        return shipped(request.param)
    text, ending, joints = OTHERS[request.param]
    values = ", ".join(["0.05"] * joints)
    return load_scenario(write_with_robot(tmp_path, text, ending, ("robot_0: [0.0]", f"robot_0: [{values}]")))


@pytest.fixture
def team(scenario):
    built, builder = team_of(scenario)
    built.__dict__["_builder"] = builder  # the builder owns the plant
    return built
