"""The measuring of departures: every case is a deployment that scenarios may have, and is its own."""

import pytest

from benchmarks.departures import CASES, OBSERVED, PREDICTED, deployment_of
from coop_drake.scenario import Control, Deployment

DATA = [data for case in CASES.values() for data in (case.mild, case.harsh) if data is not None]


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
