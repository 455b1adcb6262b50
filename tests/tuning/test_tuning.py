"""Gains are sought: criteria, limits, trials, the search, and the command."""

from __future__ import annotations

import json
import multiprocessing
import sys
import threading
from dataclasses import replace
from functools import cache
from itertools import combinations, product
from math import log
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from coop_drake.cli import app
from coop_drake.errors import TuningError
from coop_drake.laws import FixedGains, ScheduledGains
from coop_drake.scenario import Control, Deployment, load_scenario, with_gains
from coop_drake.tuning import (
    CRITERIA,
    GainTrial,
    Limit,
    Objective,
    TrialOutcome,
    TrialRunner,
    Workers,
    read_weights,
    search,
    tunable_parameters,
)
from coop_drake.tuning.objective import outcome_of
from coop_drake.tuning.search import to_fractions, with_fractions
from tests.support.cases import case
from tests.support.scenarios import write_scenario
from tests.support.small_loop import small_maps, small_problem
from tests.support.small_plan import small_plan
from tests.support.synthetic_log import SECONDS, synthetic_log

# What is sought: criteria read from runs, weights and limits, and one number for each run.

BEFORE = {"time": 20.0, "peak_force": 100.0, "clearance": 0.1}


def outcome(*, arrived=True, fraction_done=1.0, **values):
    return TrialOutcome(arrived, fraction_done, {**BEFORE, **values}, "" if arrived else "stalled")


def test_criteria_are_read_from_the_run():
    log = synthetic_log(case("base"))
    pushes = np.zeros_like(log.base_wrenches)
    pushes[10, 1] = [-3.0, 4.0, -7.0]
    torques = np.zeros_like(log.joint_torques)
    torques[20, 0] = -2.5
    log = replace(log, base_wrenches=pushes, joint_torques=torques)
    values = outcome_of(log, 5).values
    assert set(values) == set(CRITERIA)
    assert values["time"] == SECONDS
    assert values["peak_force"] == pytest.approx(5.0)
    assert values["peak_base_torque"] == 7.0
    assert values["peak_torque"] == 2.5
    assert 0.0 < values["mean_force"] < 5.0
    assert values["clearance"] == log.workspace_clearance.min()


def test_a_constant_force_is_its_own_mean_however_steps_are_spread():
    log = synthetic_log(case("base"))
    forces = np.zeros_like(log.base_wrenches)
    forces[:200, :, 0] = 6.0
    forces[200:, :, 1] = 8.0
    fraction = np.linspace(0.0, 1.0, len(log.times)) ** 3
    values = outcome_of(replace(log, base_wrenches=forces, times=SECONDS * fraction), 5).values
    early = 0.5 * (fraction[199] + fraction[200])
    assert values["mean_force"] == pytest.approx((early * 36.0 + (1.0 - early) * 64.0) ** 0.5)


def test_a_run_that_broke_off_counts_the_cells_it_passed():
    log = synthetic_log(case("base"))
    broken = outcome_of(replace(log, violation="a wall"), 5)
    assert not broken.arrived
    assert broken.fraction_done == pytest.approx(0.8)


def test_the_run_before_scores_one_and_weights_are_shares():
    objective = Objective({"peak_force": 3.0, "clearance": 1.0}, (), BEFORE)
    assert objective.score(outcome()) == pytest.approx(1.0)
    assert objective.score(outcome(peak_force=50.0)) == pytest.approx((3.0 * 0.5 + 1.0) / 4.0)
    assert objective.score(outcome(clearance=0.2)) == pytest.approx((3.0 + 0.5) / 4.0)


def test_failed_runs_are_worse_than_broken_limits_and_those_than_any_that_keeps_them():
    objective = Objective(
        {"peak_force": 1.0}, (Limit.parse("time<=1.1x"), Limit.parse("clearance>=0.05")), BEFORE
    )
    ranked = [
        outcome(peak_force=50.0, time=22.0),
        outcome(peak_force=5000.0, time=19.0),
        outcome(peak_force=10.0, time=22.1),
        outcome(peak_force=10.0, time=22.1, clearance=0.01),
        outcome(arrived=False, fraction_done=0.9),
        outcome(arrived=False, fraction_done=0.2, peak_force=1.0),
    ]
    scores = [objective.score(one) for one in ranked]
    assert scores == sorted(scores)
    assert len(set(scores)) == len(scores)
    assert [objective.kept(one) for one in ranked] == [True, True, False, False, False, False]


def test_limits_are_read():
    assert Limit.parse("time<=16") == Limit("time", True, 16.0)
    assert Limit.parse(" clearance >= 0.1 ") == Limit("clearance", False, 0.1)
    assert Limit.parse("time<=1.1x").bound(BEFORE) == pytest.approx(22.0)


@pytest.mark.parametrize("text", ["time", "time<16", "speed<=1", "time<=..", "time<=1e", "time<=1y", ""])
def test_other_limits_are_refused_by_name(text):
    with pytest.raises(TuningError, match="--limit"):
        Limit.parse(text)


def test_weights_are_read_and_others_refused():
    assert read_weights(("peak_force", "time=0.5")) == {"peak_force": 1.0, "time": 0.5}
    for text in ("speed", "time=0", "time=-1", "time=nan", "time=inf", "time=x"):
        with pytest.raises(TuningError, match="--criterion"):
            read_weights((text,))


# The search: gains within bounds, fewer runs than a sweep, the same answer however runs are spread.

SETS = [ScheduledGains(), FixedGains()]


def bowl(gains):
    """A make-believe run: forces are least at an age phase of 0.5 and a funnel acceleration of 10."""
    away = log(gains.age_phase / 0.5) ** 2 + log(gains.funnel_acceleration / 10.0) ** 2
    values = {"time": 10.0, "peak_force": 100.0 * (1.0 + away)}
    return GainTrial(gains, TrialOutcome(True, 1.0, values, ""))


def one_by_one(gain_sets):
    return (bowl(gains) for gains in gain_sets)


def at_once(gain_sets):
    return [bowl(gains) for gains in reversed(gain_sets)][::-1]


def searched(try_all=one_by_one, *, runs=60, seed=0, names=("age_phase", "funnel_acceleration")):
    before = bowl(ScheduledGains())
    objective = Objective({"peak_force": 1.0}, (), before.outcome.values)
    return search(before, tunable_parameters(before.gains, names), objective, try_all, runs=runs, seed=seed)


@pytest.mark.parametrize("gain_set", SETS, ids=lambda gains: type(gains).__name__)
def test_any_three_gains_at_any_bounds_are_a_valid_gain_set(gain_set):
    """All ways to choose the bounds of three parameters; a gain set is refused for one or two of its keys."""
    parameters = tunable_parameters(gain_set)
    for others, count in product((0.0, 1.0), range(4)):
        for chosen in combinations(range(len(parameters)), count):
            corner = np.full(len(parameters), others)
            corner[list(chosen)] = 1.0 - others
            assert type(with_fractions(gain_set, parameters, corner)) is type(gain_set)


@pytest.mark.parametrize("gain_set", SETS, ids=lambda gains: type(gains).__name__)
def test_the_search_begins_where_the_gains_are(gain_set):
    parameters = tunable_parameters(gain_set)
    assert with_fractions(gain_set, parameters, to_fractions(gain_set, parameters)) == gain_set


def test_a_gain_that_cannot_be_turned_is_refused():
    with pytest.raises(TuningError, match="expected one of stiffness, damping"):
        tunable_parameters(FixedGains(), ["funnel"])


@pytest.mark.parametrize("names", [("age_phase", "funnel_acceleration"), ()])
def test_gains_get_better_and_the_number_of_runs_is_kept(names):
    found = searched(names=names)
    assert len(found.trials) == 61
    assert found.scores[0] == 1.0
    least = 100.0 / found.trials[0].outcome.values["peak_force"]
    assert min(found.scores) < 0.5 * (1.0 + least)  # More than half the way to what can be had.
    assert found.objective.score(found.best.outcome) == min(found.scores)


def test_the_same_seed_gives_the_same_gains_however_runs_are_spread():
    state = np.random.get_state()[1].copy()  # noqa: NPY002  The global generator must stay as it was.
    assert searched(at_once).trials == searched().trials
    assert searched(seed=1).trials != searched().trials
    np.testing.assert_array_equal(np.random.get_state()[1], state)  # noqa: NPY002


@pytest.mark.parametrize("runs", [1, 7])
def test_fewer_runs_than_a_generation_are_made_and_no_more(runs):
    assert len(searched(runs=runs).trials) == 1 + runs


def test_the_best_trial_is_simulated_by_drakes_loop_until_one_stays_the_best():
    """In Drake's loop forces are larger for the three best trials, and not for the fourth."""
    found = searched(lambda gain_sets: (replace(bowl(gains), loop="compiled") for gains in gain_sets))
    best, simulated = [found.trials[k].gains for k in np.argsort(found.scores)[:4]], []

    def simulate(gains):
        simulated.append(gains)
        made = bowl(gains)
        worse = {**made.outcome.values, "peak_force": 150.0}
        return made if len(simulated) == 4 else replace(made, outcome=replace(made.outcome, values=worse))

    found.verify(simulate)
    assert simulated == best
    assert found.best == bowl(best[-1])


def test_ctrl_c_ends_the_search_with_what_was_found():
    done = []

    def interrupted(gain_sets):
        for gains in gain_sets:
            if len(done) == 17:
                raise KeyboardInterrupt
            done.append(bowl(gains))
            yield done[-1]

    found = searched(interrupted)
    assert found.interrupted
    assert found.trials[1:] == done
    assert found.best.outcome.values["peak_force"] == min(
        trial.outcome.values["peak_force"] for trial in found.trials
    )


# Trials of gains: the compiled loop in place of Drake's where it knows the team, with the same criteria.

OTHER = ScheduledGains(age_phase=0.3)


@cache
def simulated(rate):
    """Drake's trials of the usual and of other gains."""
    return [runner(rate).simulate(gains) for gains in (ScheduledGains(), OTHER)]


def runner(rate=None, control=None, **options):
    scenario, plan = small_problem()
    wanted = replace(scenario, deployment=Deployment(control_rate=rate), control=control or Control())
    return TrialRunner(wanted, plan, small_maps(), **options)


@pytest.mark.parametrize(("rate", "close"), [(200.0, 2e-3), (None, 0.2)], ids=["sampled", "continuous"])
def test_the_compiled_loop_measures_trials_as_drakes_loop_does(rate, close):
    trials = runner(rate)
    for expected in simulated(rate):
        found = trials.estimate(expected.gains)
        assert (found.loop, found.outcome.arrived) == ("compiled", True)
        # A sampled team says that it has arrived by a mean over a tenth of a second.
        assert found.outcome.values["time"] == pytest.approx(expected.outcome.values["time"], abs=0.1)
        for name in CRITERIA:
            assert found.outcome.values[name] == pytest.approx(expected.outcome.values[name], rel=close), name


def test_runs_that_last_too_long_have_failed():
    trials = runner(longest=2.0 * simulated(None)[0].outcome.values["time"])
    slow = trials.estimate(ScheduledGains(ramp_fraction=0.01, max_log_gain=1e-3, log_acceleration=0.02))
    assert slow.loop == "compiled"
    assert not slow.outcome.arrived
    assert slow.outcome.fraction_done < 1.0


def test_drakes_loop_runs_what_the_compiled_one_does_not_know():
    trial = runner(control=Control(observer=True)).estimate(OTHER)
    assert trial.loop == "drake"


# The command tune on a small room: a gain set that `run` takes, and refusals before any work.


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    goal = {"object": {"x": 2.6, "y": 2.0, "theta": 0.0}, "tolerances": {"position": 0.05, "angle": 0.05}}
    return write_scenario(tmp_path_factory.mktemp("room") / "room.scenario.yaml", goal=goal)


def called(*arguments):
    return CliRunner().invoke(app, ["tune", *map(str, arguments)])


@pytest.mark.slow
def test_a_gain_set_comes_out_that_the_scenario_takes(room, tmp_path):
    result = called(room, "--runs", 2, "--workers", 1, "--vary", "age_phase", "--out", tmp_path, "--json")
    assert result.exit_code == 0, result.output
    facts = json.loads(result.stdout.splitlines()[-1])
    assert facts["trials"] == 2
    assert facts["after"]["time"] <= facts["before"]["time"]
    assert facts["after"]["peak_force"] <= facts["before"]["peak_force"]
    tuned = with_gains(load_scenario(room), facts["gains_file"])
    trials = json.loads((tmp_path / "trials.json").read_text())
    assert len(trials["trials"]) == 3
    assert tuned.gain_sets["tuned"].age_phase == trials["trials"][trials["best"]]["gains"]["age_phase"]
    assert (tmp_path / "tuning.png").stat().st_size > 10_000
    assert "seed 0. Verified" in (tmp_path / "gains.yaml").read_text()


def test_ctrl_c_leaves_the_best_so_far(room, tmp_path, monkeypatch):
    def interrupted(_workers, _gain_sets):
        raise KeyboardInterrupt

    monkeypatch.setattr(Workers, "try_all", interrupted)
    result = called(room, "--workers", 1, "--out", tmp_path)
    assert result.exit_code == 130
    assert "Not verified: interrupted after 0 trials" in (tmp_path / "gains.yaml").read_text()
    assert "tuned for a team that rests in every cell" in " ".join(result.output.split())


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("--criterion", "speed"), "expected one of time"),
        (("--limit", "time<16"), "expected such as"),
        (("--vary", "funnel"), "expected one of age_phase"),
        (("--gains", "fast"), "or a file with a gain set"),
    ],
)
def test_what_makes_no_sense_is_refused_before_any_work(room, tmp_path, arguments, complaint):
    result = called(room, *arguments, "--out", tmp_path / "out")
    assert result.exit_code == 2
    assert complaint in " ".join(result.output.split())
    assert not (tmp_path / "out").exists()


def test_a_missing_optimizer_is_named_before_any_work(room, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "cma", None)
    result = called(room, "--out", tmp_path / "out")
    assert result.exit_code == 2
    assert "pip install 'cma>=4.0'" in " ".join(result.output.split())
    assert not (tmp_path / "out").exists()


def test_processes_end_amid_their_trials_without_a_word(monkeypatch):
    said = []
    monkeypatch.setattr(threading, "excepthook", said.append)
    with Workers(Path("none.scenario.yaml"), small_plan(()), (), longest=1.0, count=1) as workers:
        trials = workers.try_all([ScheduledGains()] * 8)
        del trials  # As where Ctrl-C leaves the loop over them.
    assert not said
    assert not multiprocessing.active_children()
