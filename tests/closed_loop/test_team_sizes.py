"""The law is exact on thirty cells whatever the size of the team, its arms, its grasps and shares."""

from math import pi

import numpy as np
import pytest

from coop_drake.simulation import build_maps, simulate
from tests.support.ring_team import PRISMATIC, REVOLUTE, ring_team
from tests.support.small_loop import joint_names
from tests.support.small_plan import round_trip

pytestmark = pytest.mark.slow

ONE, TWO, THREE = (REVOLUTE,), (REVOLUTE, REVOLUTE), (REVOLUTE, REVOLUTE, REVOLUTE)
SLIDE, MIXED = (PRISMATIC,), (PRISMATIC, REVOLUTE)
TEAMS = {
    "two": [ONE, MIXED],
    "three": [TWO, SLIDE, THREE],
    "four": [ONE, TWO, SLIDE, THREE],
    "eight": [ONE, TWO, (), SLIDE, ONE, MIXED, THREE, ONE],
}


@pytest.fixture(scope="module")
def maps():
    """Of the plan's cells, which are the same for every team."""
    return build_maps(round_trip(()))


@pytest.fixture(scope="module", params=TEAMS)
def run(request, tmp_path_factory, maps):
    folder = tmp_path_factory.mktemp(request.param)
    # Three robots all hold the same half of the object.
    scenario = ring_team(folder, TEAMS[request.param], arc=pi if request.param == "three" else 2.0 * pi)
    log = simulate(scenario, round_trip(joint_names(scenario)), maps)
    return scenario, log


def test_it_arrives_and_every_equation_holds_on_the_way(run):
    scenario, log = run
    assert log.violation == ""
    assert log.reached
    assert log.cell_index[-1] == 29
    assert len(log.robot_names) == len(scenario.load_shares)
    largest = np.abs(np.gradient(log.object_twist, log.times, axis=0)).max()
    assert log.acceleration_error.max() <= 1e-12 * max(1.0, largest)
    assert log.wrench_error.max() <= 1e-10
    assert log.governor_spread.max() == 0.0
    assert log.energy_margin.min() >= 0.0
    assert min(log.funnel_margin.min(), log.slice_margin.min(), log.cell_clearance.min()) > 0.0


def test_every_robot_carries_its_share(run):
    scenario, log = run
    total = log.object_wrench[:, None, :2]
    shares = np.array([scenario.load_shares[name] for name in log.robot_names])
    assert np.ptp(shares) > 0.01
    np.testing.assert_allclose(log.measured_wrenches[:, :, :2], shares[:, None] * total, atol=1e-9)
