"""A team whose drives brake within its budget rests where it can begin a cell anew with what is promised."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.one_process import DirectExchange, simulate_apart
from coop_drake.answers import load_plan
from coop_drake.cli.task import read_task
from coop_drake.errors import RefusalError
from coop_drake.simulation import build_maps
from coop_drake.verification.budgets import check_restart
from tests.support.cli import invoke
from tests.support.scenarios import write_scenario

pytestmark = pytest.mark.no_cover


@pytest.fixture(scope="module")
def transport(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stops")
    file = folder / "room.scenario.yaml"
    goal = {"object": {"x": 4.5, "y": 2.0, "theta": 3.0}}
    write_scenario(file, goal=goal, deployment={"preset": "mobile_base", "budget": "all"})
    result = invoke("plan", file, "--out", folder)
    assert result.exit_code == 0, result.output
    task, plan = read_task(file), load_plan(folder / "plan.json")
    maps = build_maps(plan, tolerance=task.scenario.maps.tolerance)
    return task.scenario, plan, maps, task.problem.tree


@pytest.mark.slow
def test_whenever_the_drives_brake_the_team_rests_where_it_can_begin_a_cell_anew(transport):
    scenario, plan, maps = transport[:3]
    gaps = [(round(begin * 200), round(begin * 200) + 60) for begin in (0.8, 3.8, 8.0)]
    exchange = DirectExchange(gaps)
    log = simulate_apart(scenario, plan, maps, exchange=exchange)
    stops = exchange.membership.stops
    assert log.reached, log.violation
    assert len(stops) == 3
    assert all(stop.certified for stop in stops)
    follows = np.ones(len(log.times), dtype=bool)
    for stop in stops:
        follows &= (log.times < stop.since) | (log.times > stop.resumed)
    for name in ("funnel_margin", "slice_margin", "cell_clearance"):
        assert getattr(log, name)[follows].min() > 0.0
    assert min(log.workspace_clearance.min(), log.body_clearance.min()) > 0.0


ALTERED = {
    "departures": lambda restart: tuple(0.9 * own for own in restart.departures),
    "rate": lambda restart: 1.5 * restart.rate,
    "acceleration": lambda restart: 2.0 * restart.acceleration,
    "rest_rate": lambda restart: 0.5 * restart.rest_rate,
    "wait": lambda restart: 0.5 * restart.wait,
}


def test_what_the_plan_states_about_rests_is_accepted(transport):
    _, plan, _, tree = transport
    assert check_restart(plan, tree).count == len(plan.cells)
    assert check_restart(replace(plan, restart=None), tree) is None


@pytest.mark.parametrize("name", ALTERED)
def test_any_other_statement_about_rests_is_refused(transport, name):
    _, plan, _, tree = transport
    restart = replace(plan.restart, **{name: ALTERED[name](plan.restart)})
    with pytest.raises(RefusalError, match="restart"):
        check_restart(replace(plan, restart=restart), tree)


def test_rates_at_rest_that_the_tube_does_not_hold_are_refused(transport):
    _, plan, _, tree = transport
    with pytest.raises(RefusalError, match=r"restart\.rest_rate"):
        check_restart(replace(plan, restart=replace(plan.restart, rest_rate=0.5)), tree)
