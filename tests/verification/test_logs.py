"""The checker of logs accepts runs as they were, and refuses alterations that make a statement false."""

from dataclasses import fields, replace

import numpy as np
import pytest

from coop_drake.compiled_loop import simulate_fused
from coop_drake.errors import RefusalError
from coop_drake.plant import planning_problem, run_setup
from coop_drake.verification.runs import verify_log
from tests.support.run_oracle import RunOracle
from tests.support.small_loop import small_maps, small_problem

STATES = {"times", "object_pose", "joints", "base_poses", "accelerations", "base_wrenches", "joint_torques"}
"""Arrays of which no altered number is accepted."""

ALTERATIONS = 6
"""Alterations of every array."""


@pytest.fixture(scope="module")
def case():
    """A short run of an ideal team, and all that it is checked against."""
    scenario, plan = small_problem("base")
    log = simulate_fused(scenario, plan, small_maps())
    return log, (plan, planning_problem(scenario), run_setup(scenario)), RunOracle(scenario, plan)


def arrays(log):
    return [f.name for f in fields(log) if isinstance(getattr(log, f.name), np.ndarray)]


def altered(log, name, generator):
    """The log with one number of an array altered, and the row."""
    values = getattr(log, name).copy()
    at = tuple(generator.integers(size) for size in values.shape)
    other = values[(generator.integers(len(values)), *at[1:])]
    if values.dtype.kind == "i":
        values[at] += generator.choice([-1, 1])
    else:
        size = 1e-3 * (1.0 + abs(values[at]))
        choices = [-values[at], values[at] * 1.001, values[at] + size, other, values[at] - 1e3 * size, np.nan]
        values[at] = generator.choice(choices)
    return replace(log, **{name: values}), int(at[0])


def refused(log, against):
    try:
        verify_log(log, *against)
    except RefusalError as error:
        return error
    return None


def test_a_run_is_accepted_as_it_was(case):
    log, against, oracle = case
    verified = verify_log(log, *against)
    assert (verified.answer, len(verified.checks)) == ("arrived", 21)
    assert [name for row in range(0, len(log.times), 20) for name in oracle.false_at(log, row)] == []


def test_an_altered_number_is_refused_or_makes_nothing_false(case):
    log, against, oracle = case
    generator = np.random.default_rng(13)
    accepted = set()
    for name in arrays(log):
        for _ in range(ALTERATIONS):
            other, row = altered(log, name, generator)
            error = refused(other, against)
            if error is None:
                accepted.add(name)
                assert oracle.false_at(other, row) == [], (name, row)
            else:
                assert "t = " in error.finding or "[" in error.where, name
    assert accepted.isdisjoint(STATES)


@pytest.mark.parametrize(
    ("change", "where"),
    [
        ({"plan_digest": "0" * 64}, "plan_digest"),
        ({"scenario_digest": ""}, "scenario_digest"),
        ({"robot_names": ("robot_1", "robot_0")}, "robot_names"),
        ({"reached": False}, "reached"),
        ({"violation": "stalled"}, "reached"),
    ],
)
def test_other_entries_are_refused_by_name(case, change, where):
    log, against, _ = case
    assert refused(replace(log, **change), against).where == where


def test_a_log_with_too_few_rows_is_refused_as_too_sparse(case):
    log, against, _ = case
    kept = np.unique(np.concatenate([np.arange(0, len(log.times), 8), *entries(log), [len(log.times) - 1]]))
    thinned = replace(log, **{name: getattr(log, name)[kept] for name in arrays(log)})
    assert "the log is too sparse" in refused(thinned, against).finding


def test_distances_between_rows_are_bounded_closely(case):
    log, (plan, problem, setup), _ = case
    between = verify_log(log, plan, problem, setup).checks[-1].tightest
    gap = min(log.workspace_clearance.min(), log.body_clearance.min())
    assert 0.9 * gap < between <= gap


def entries(log):
    """The rows about every change of the cell."""
    changes = np.flatnonzero(np.diff(log.cell_index))
    return [changes, changes + 1]
