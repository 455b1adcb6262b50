"""The measuring of departures: every case is a deployment that scenarios may have, and is its own."""

import pytest

from benchmarks.departures import CASES, OBSERVED, PREDICTED, TEAMS, departure_tasks, deployment_of
from benchmarks.deployed import DEPLOYMENTS, deployed_tasks
from coop_drake.scenario import Control, Deployment

DATA = [data for case in CASES.values() for data in (case.mild, case.harsh) if data is not None]


def test_there_are_tasks_for_every_team():
    names = [task.name.split("/")[1] for task in departure_tasks()]
    for team in TEAMS:
        assert names.count(team) == len(CASES)
        assert names.count(f"{team}_additions") == len(OBSERVED) + len(PREDICTED)


def test_cases_are_deployments_each_of_its_own():
    found = [repr(deployment_of(data)) for data in (*DATA, *OBSERVED.values(), *PREDICTED.values())]
    assert len(set(found[: len(DATA)])) == len(DATA)
    assert deployment_of(CASES["nothing"].mild) == Deployment()
    assert deployment_of(CASES["sampling"].mild) == Deployment(control_rate=200.0)


@pytest.mark.parametrize("part", ["measurements", "actuators", "messages", "floor", "robots", "pushes"])
def test_every_departure_has_its_case(part):
    """Whatever differs from the ideal team somewhere in a section does so in a case."""
    assert any(getattr(deployment_of(data), part) != getattr(Deployment(), part) for data in DATA)


def test_an_addition_is_off_by_default():
    assert Control() == Control(predictor=False, observer=False)


def test_every_row_under_the_preset_has_as_many_runs_as_seeds_and_mass_errors():
    assert len(deployed_tasks()) == 15
    for label, data in DEPLOYMENTS.items():
        runs = [deployment_of(one) for one in data]
        assert len({repr(run) for run in runs}) == len(data) == (1 if label == "ideal" else 15)
    assert {deployment_of(one).measurements.delay for one in DEPLOYMENTS["preset_20_ms"]} == {0.02}
    assert deployment_of(DEPLOYMENTS["ideal"][0]).ideal
