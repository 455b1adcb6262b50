"""ET1: Table 1 itself, and its thirty cells through the whole loop."""

import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder

from coop_drake.errors import ScenarioError
from coop_drake.laws import ScheduledGains, transition_gains
from coop_drake.plant import build_team_plant, planning_problem
from coop_drake.scenario import load_scenario
from paper import compare_gains, corridor_plan, corridor_scenario
from paper.table_1 import (
    CORRECTED,
    PRINTED,
    START,
)
from tests.support.scenarios import MODELS
from tests.support.table_1 import table_transitions

pytestmark = pytest.mark.slow

JOINT_RANGE = 3.74
OVERLAPS = np.array([0.1, 0.15, 0.2])


def is_dyadic(width):
    """Whether a width is the joint's range halved some times, plus an overlap that the table uses."""
    return bool(np.any(np.abs(width - OVERLAPS[:, None] - JOINT_RANGE / 2.0 ** np.arange(8)) < 0.003))


def joint_widths(table):
    return np.hstack([table[:, 3] - table[:, 2], table[:, 5] - table[:, 4]])


def test_et1_only_rows_3_and_24_as_printed_are_no_parts_of_the_joints_range():
    odd = [i for i, width in enumerate(joint_widths(PRINTED)) if not is_dyadic(width)]
    assert odd == [len(PRINTED) + 2, len(PRINTED) + 23]
    assert all(is_dyadic(width) for width in joint_widths(CORRECTED))


def test_e39_the_columns_with_an_overbar_are_the_lower_ends():
    assert np.all(PRINTED[:, 2] < PRINTED[:, 3])
    assert np.all(PRINTED[:, 4] < PRINTED[:, 5])


def test_consecutive_rows_overlap_and_the_start_lies_in_the_first():
    transitions = table_transitions(CORRECTED)
    for transition in transitions:
        assert np.all(transition["goal_lower"] < transition["goal_upper"])
    assert np.all(transitions[0]["slice_lower"] < START)
    assert np.all(transitions[0]["slice_upper"] > START)


def test_one_bound_on_the_energy_for_all_transitions_would_stop_at_the_worst():
    """The energies at rest differ by a large factor, so a bound that fits one switch blocks another."""
    gain_set = ScheduledGains()
    at_rest = []
    for transition in table_transitions(CORRECTED)[1:]:
        gains = transition_gains(gain_set, clearance=0.2, **transition)
        at_rest.append(
            (gains.energy_bound - gain_set.energy_allowance * gains.log_gain) / gain_set.energy_factor
        )
    largest = np.max(at_rest, axis=1)
    assert largest.max() > 2.0 * np.median(largest)


# The thirty cells of Table 1 through the whole loop, with the paper's gains and with the scheduled ones.


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
