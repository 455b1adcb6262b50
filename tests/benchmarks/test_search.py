from math import inf, nan

import numpy as np
import pytest

import coop_drake
from benchmarks.searches.departures import BoundedDepartures
from benchmarks.searches.searching import first_lost, margin_of, search_worst
from coop_drake.campaign.records import RunRecord
from coop_drake.plant import planning_problem
from coop_drake.plant.facts import budget_of
from coop_drake.scenario.budget_file import wave_bounds
from coop_drake.scenario.deployment import Wave, Waves
from tests.support.scenarios import write_scenario


@pytest.fixture(scope="module")
def departures(tmp_path_factory):
    folder = tmp_path_factory.mktemp("room")
    file = write_scenario(folder / "room.scenario.yaml", deployment={"preset": "mobile_base"})
    scenario = coop_drake.load_scenario(file)
    problem = planning_problem(scenario)
    return BoundedDepartures(budget_of("all", scenario, problem), problem.tree), problem.tree


def waves_in(values):
    names = {key.split(".")[3] for key in values if ".waves." in key}
    prefix = "deployment.measurements.waves"
    return Waves(
        **{
            name: Wave(*(values[f"{prefix}.{name}.{part}"] for part in ("size", "period", "phase")))
            for name in names
        }
    )


def test_departures_reach_the_bounds_of_the_budget_and_never_exceed_them(departures):
    bounded, tree = departures
    budget, generator = bounded.budget, np.random.default_rng(1)
    rates, velocities, places, axes = [], [], [], []
    for _ in range(200):
        values = bounded.values(generator.uniform(size=len(bounded.names)))
        reached = wave_bounds(waves_in(values), tree)
        assert reached.angle == pytest.approx(budget.angle_noise)
        assert reached.position == pytest.approx(budget.position_noise)
        rates.append(reached.rate / budget.rate_noise)
        velocities.append(reached.velocity / budget.velocity_noise)
        assert abs(values["deployment.mass_error"]) <= budget.model_error
        assert 0.0 <= values["deployment.measurements.delay"] <= budget.delay
        assert 0.0 <= values["deployment.messages.delay"] <= budget.report_age
        start = {key.split(".")[-1]: value for key, value in values.items() if "start_offset" in key}
        places.append(np.hypot(start["x"], start["y"]) / budget.position_noise)
        axes.append(np.abs([start["theta"], *start["joints"]]).max() / budget.angle_noise)
        assert len(start["joints"]) == len(tree.joints)
        assert 2.0 * budget.period <= waves_in(values).angle.period <= 4.0
    assert max(places) == pytest.approx(1.0)
    assert 0.9 < max(axes) <= 1.0
    assert max(rates) <= 1.0 + 1e-12
    assert max(velocities) <= 1.0 + 1e-12
    assert max(np.maximum(rates, velocities)) == pytest.approx(1.0)
    assert values["deployment.measurements.rate_noise"] == values["deployment.messages.loss"] == 0.0


def test_a_direction_turned_by_half_a_turn_gives_the_opposite_error(departures):
    bounded, _ = departures
    there, back = (bounded.middle, bounded.middle)
    at = bounded.names.index("direction of position")
    there[at], back[at] = 0.0, 0.5
    one, two = (waves_in(bounded.values(fractions)).x for fractions in (there, back))
    assert one.size == two.size > 0.0
    assert (one.phase - two.phase) % 1.0 == pytest.approx(0.5)


def record(margin, arrived=True, **more):
    return RunRecord(0, "base", "drake", 1, "{}", arrived, funnel_margin=margin, **more)


def bowl(values):
    """The margin falls towards departures at (0.8, 0.2), where it is 1 mrad."""
    return [record(1e-3 + 1e-2 * ((x["a"] - 0.8) ** 2 + (x["b"] - 0.2) ** 2)) for x in values]


def named(fractions):
    return {"a": float(fractions[0]), "b": float(fractions[1])}


def test_a_search_finds_the_worst_departures_and_the_same_ones_again():
    found = [
        search_worst(np.full(2, 0.5), named, bowl, margin="funnel_margin", evaluations=150, seed=3)
        for _ in range(2)
    ]
    assert found[0] == found[1]
    assert found[0].record.funnel_margin == min(found[0].margins) == pytest.approx(1e-3, abs=1e-5)
    assert found[0].values["a"] == pytest.approx(0.8, abs=0.05)
    assert found[0].margins[0] == pytest.approx(1e-3 + 1e-2 * 0.18)
    assert len(found[0].margins) == 150


def test_a_lost_run_ends_a_search():
    def falling(values):
        return [
            record(-1e-4, arrived=False) if x["a"] > 0.6 else record(0.01 - x["a"] / 100.0) for x in values
        ]

    found = search_worst(np.full(2, 0.5), named, falling, margin="funnel_margin", evaluations=500, seed=1)
    assert not found.record.arrived
    assert found.values["a"] > 0.6
    assert len(found.margins) < 60


def test_a_lost_run_ends_a_search_whatever_the_margins_of_those_that_arrived():
    def shares(values):
        lost = [x["a"] > 0.6 for x in values]
        return [
            record(nan, arrived=not gone, budget_share=nan if gone else 1.5 + x["b"])
            for x, gone in zip(values, lost, strict=True)
        ]

    found = search_worst(np.full(2, 0.5), named, shares, margin="budget_share", evaluations=500, seed=1)
    assert not found.record.arrived
    assert found.values["a"] > 0.6
    assert len(found.margins) < 60
    assert found.first.budget_share == 2.0


def test_the_lost_run_with_the_smallest_margin_is_the_worst_of_its_generation():
    def falling(values):
        return [record(-x["b"], arrived=x["a"] == 0.5) for x in values]

    found = search_worst(np.full(2, 0.5), named, falling, margin="funnel_margin", evaluations=500, seed=1)
    assert not found.record.arrived
    assert found.record.funnel_margin == min(found.margins[1:])


def test_a_margin_that_a_run_does_not_tell_is_larger_than_any_other():
    assert margin_of(record(2e-3), "funnel_margin") == 2e-3
    assert margin_of(record(nan), "funnel_margin") == inf
    assert margin_of(record(2e-3, budget_share=0.7), "budget_share") == pytest.approx(0.3)
    assert margin_of(record(2e-3), "budget_share") == inf


@pytest.mark.parametrize("edge", [0.3, 1.0, 1.7, 11.3])
def test_bisection_encloses_the_multiple_at_which_runs_are_lost(edge):
    tried = []

    def lost(multiple):
        tried.append(multiple)
        return f"left at {multiple}" if multiple >= edge else ""

    kept, upper, reason = first_lost(lost, halvings=8)
    assert kept < edge <= upper
    assert upper - kept <= max(1.0, edge) / 2**7
    assert reason == f"left at {upper}"
    assert len(tried) == len(set(tried))


def test_where_nothing_is_lost_bisection_says_how_far_it_looked():
    assert first_lost(lambda multiple: "", halvings=5, largest=16.0) == (16.0, inf, "")


def test_multiples_that_cannot_be_simulated_are_not_tried():
    def lost(multiple):
        assert multiple <= 10.0
        return ""

    assert first_lost(lost, 5, 64.0, lambda multiple: multiple <= 10.0) == (8.0, inf, "")
