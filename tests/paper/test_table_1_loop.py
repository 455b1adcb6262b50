"""The thirty cells of Table 1 through the whole loop, with the paper's gains and with the scheduled ones."""

import pytest
from pydrake.systems.framework import DiagramBuilder

from coop_drake.errors import ScenarioError
from coop_drake.laws import ScheduledGains
from coop_drake.plant import build_team_plant, planning_problem
from coop_drake.scenario import load_scenario
from paper import CORRECTED, compare_gains, corridor_plan, corridor_scenario
from tests.support.scenarios import MODELS

pytestmark = pytest.mark.slow


def shipped(name):
    return load_scenario(MODELS / f"{name}.scenario.yaml")


@pytest.fixture(scope="module")
def figures():
    return {f.name: f for f in compare_gains(shipped("base"))}


def test_the_plan_has_the_table_s_intervals_and_walks_through_the_hall():
    hall = corridor_scenario(shipped("base"))
    problem = planning_problem(hall, build_team_plant(hall, DiagramBuilder()))
    plan = corridor_plan(problem, ScheduledGains(), "scheduled")
    assert [(*cell.lower, *cell.upper) for cell in plan.cells] == [(*r[0::2], *r[1::2]) for r in CORRECTED]
    assert [transition.only_angles for transition in plan.transitions] == [False] * 29 + [True]


@pytest.mark.parametrize("name", ["table_2", "scheduled"])
def test_every_equation_holds_on_every_step_of_thirty_cells(figures, name):
    gains = figures[name]
    assert gains.violation == ""
    assert gains.funnel_margin > 0.005
    assert gains.energy_margin >= 0.0
    assert gains.acceleration_error <= 1e-12 * max(1.0, gains.peak_angular_acceleration)
    assert gains.wrench_error <= 1e-10
    assert gains.governor_spread == 0.0


def test_the_scheduled_gains_are_gentler_and_no_slower(figures):
    table_2, scheduled = figures["table_2"], figures["scheduled"]
    assert scheduled.peak_force < 0.5 * table_2.peak_force
    assert scheduled.peak_angular_acceleration < 0.5 * table_2.peak_angular_acceleration
    assert scheduled.seconds < table_2.seconds


def test_another_team_is_refused():
    with pytest.raises(ScenarioError, match="two robots with one joint each"):
        corridor_scenario(shipped("elbow"))
