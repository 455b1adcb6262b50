"""The checker of logs accepts runs as they were, and refuses alterations that make a statement false."""

from dataclasses import fields, replace

import numpy as np
import pytest

from coop_drake.errors import RefusalError
from coop_drake.plant import planning_problem, run_setup
from coop_drake.simulation import simulate
from coop_drake.verification.runs import Rows, verify_log
from coop_drake.verification.runs.laws import check_handovers
from tests.support.motions import motion_under_budget
from tests.support.small_loop import small_maps, small_problem

LOOSE = {"exact": False, "rigid": False, "mechanics": False, "one_clock": False, "alike": False}
"""A team that departs from the ideal one in every way that leaves a check aside."""

ADVICE = (
    "is neither compared nor named as read from the log. Let a check compute it again and add it to that "
    "check's `arrays`; what is in no check's `arrays` is named by `verify`"
)

STATES = {"times", "object_pose", "joints", "base_poses", "accelerations", "base_wrenches", "joint_torques"}
"""Arrays of which no altered number is accepted."""

CLOSE = 2e-6
"""Of other arrays of an ideal team's log, alterations that are accepted are smaller [-, m, rad, N]."""

ALTERATIONS = 6
"""Alterations of every array."""


@pytest.fixture(scope="module")
def case():
    """A short run of an ideal team, and all that it is checked against."""
    scenario, plan = small_problem("base")
    log = simulate(scenario, plan, small_maps())
    return log, (plan, planning_problem(scenario), run_setup(scenario))


def arrays(log):
    return [f.name for f in fields(log) if np.size(getattr(log, f.name)) and f.metadata["kind"] == "fi"]


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


def refused(log, against, braked=False):
    try:
        verify_log(log, *against, braked=braked)
    except RefusalError as error:
        return error
    return None


def test_a_run_is_accepted_as_it_was(case):
    log, against = case
    verified = verify_log(log, *against)
    assert (verified.answer, len(verified.checks)) == ("arrived", 22)


def test_an_altered_number_is_refused_unless_it_is_the_same_up_to_rounding(case):
    log, against = case
    generator = np.random.default_rng(13)
    for name in arrays(log):
        for _ in range(ALTERATIONS):
            other, row = altered(log, name, generator)
            error, away = refused(other, against), np.abs(getattr(other, name)[row] - getattr(log, name)[row])
            if error is None:
                assert away.max() <= (0.0 if name in STATES else CLOSE), (name, row)
            else:
                assert "t = " in error.finding or "[" in error.where, name


@pytest.fixture(scope="module")
def budgeted():
    """A run of a noisy team under a plan with a budget, and all that it is checked against."""
    scenario, plan = motion_under_budget()
    log = simulate(scenario, plan, small_maps())
    return log, (plan, planning_problem(scenario), run_setup(scenario))


@pytest.fixture(params=["deployed", "loose", "braked", "budget"])
def claimed(request, case, budgeted):
    """Logs, what they are checked against, and whether all drives braked."""
    log, (plan, problem, setup) = case
    if request.param == "budget":
        return *budgeted, False
    loose = LOOSE if request.param == "loose" else {"exact": False}
    return log, (plan, problem, replace(setup, **loose)), request.param == "braked"


@pytest.mark.slow
def test_every_array_of_a_log_is_compared_with_something_or_named_as_read(claimed):
    log, against, braked = claimed
    verified = verify_log(log, *against, braked=braked)
    named = (
        verified.not_proved.partition("which are read as they are logged: ")[2].partition(";")[0].split(", ")
    )
    for number, name in enumerate(arrays(log)):
        values = getattr(log, name)
        at = ((7 + 13 * number) % (len(values) - 2) + 1, *[size - 1 for size in values.shape[1:]])
        other = values.copy()
        other[at] += 1 if values.dtype.kind == "i" else 0.02 + 0.1 * np.ptp(values[(slice(None), *at[1:])])
        error = refused(replace(log, **{name: other}), against, braked=braked)
        assert error is not None or name in named, f"{name} {ADVICE}"


def test_what_is_named_as_read_from_a_log(case, budgeted):
    """Of an ideal team's log all is compared, of others less."""
    log, (plan, problem, setup) = case
    said = [verify_log(log, plan, problem, replace(setup, exact=exact)).not_proved for exact in (True, False)]
    assert "as they are logged" not in said[0]
    for name in ("energy_margin", "ready_margins", "governor_position", "commanded_wrenches"):
        assert name in said[1]
    log, against = budgeted
    said = verify_log(log, *against).not_proved
    assert "phases" not in said
    assert "ready_margins" in said


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
    log, against = case
    assert refused(replace(log, **change), against).where == where


def test_a_log_with_too_few_rows_is_refused_as_too_sparse(case):
    log, against = case
    kept = np.unique(np.concatenate([np.arange(0, len(log.times), 8), *entries(log), [len(log.times) - 1]]))
    thinned = replace(log, **{name: getattr(log, name)[kept] for name in arrays(log)})
    assert "the log is too sparse" in refused(thinned, against).finding


def test_a_cell_that_is_kept_although_all_robots_are_ready_is_refused(case):
    log, (plan, *_) = case
    row, names = int(entries(log)[0][0]), ("cell_index", "transition_start", "ready_margins")
    cells, starts, ready = (getattr(log, name).copy() for name in names)
    starts[cells == cells[row] + 1] = log.times[row + 1]
    cells[row + 1], starts[row + 1], ready[row + 1] = cells[row], starts[row], 1.0
    later = replace(log, **dict(zip(names, (cells, starts, ready), strict=True)))
    assert len(check_handovers(Rows(log, plan), exact=True)) == 2
    with pytest.raises(RefusalError, match="is kept although all robots are ready"):
        check_handovers(Rows(later, plan), exact=True)


def test_distances_between_rows_are_bounded_closely(case):
    log, (plan, problem, setup) = case
    between = verify_log(log, plan, problem, setup).checks[-1].tightest
    gap = min(log.workspace_clearance.min(), log.body_clearance.min())
    assert 0.9 * gap < between <= gap


def entries(log):
    """The rows about every change of the cell."""
    changes = np.flatnonzero(np.diff(log.cell_index))
    return [changes, changes + 1]
