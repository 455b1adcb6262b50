"""From the question to the goal without Drake: searched, tidied, mapped and carried out by a point mass."""

import numpy as np
import pytest

from coop_drake.answers import Found, load_plan, save_plan
from coop_drake.answers.plan_checks import check_plan
from coop_drake.laws import ScheduledGains
from coop_drake.planning.planner import plan
from tests.support.cases import case
from tests.support.point_mass import build_fields, carry_out


@pytest.fixture(scope="module")
def base():
    problem = case("base")
    result = plan(problem, ScheduledGains(), gain_set_name="scheduled")
    assert isinstance(result, Found)
    return problem, result.plan


def test_the_plan_is_executable_and_tidy(base):
    _, made = base
    check_plan(made, "base")
    assert len(made.cells) >= 15
    for cell in made.cells:
        assert not cell.tidied.interiors
    assert np.mean([len(cell.tidied.exterior.coords) for cell in made.cells]) < 25


def test_the_plan_on_disk_is_the_same_plan(base, tmp_path):
    _, made = base
    first = save_plan(made, tmp_path / "first.json")
    second = save_plan(load_plan(first), tmp_path / "second.json")
    assert first.read_bytes() == second.read_bytes()


def test_the_transport_arrives_in_time_and_stays_in_its_cells(base):
    problem, made = base
    transport = carry_out(made, build_fields(made))
    assert transport.stuck is None
    assert float(np.sum(transport.durations)) <= 60.0
    assert transport.least_energy_margin >= 0.0
    assert transport.least_cell_clearance > 0.0
    assert transport.least_funnel_gap > 0.0
    assert np.hypot(*(transport.position - problem.goal_pose[:2])) <= problem.position_tolerance
    assert abs(transport.axes[0] - made.goal_pose[2]) <= problem.angle_tolerance
