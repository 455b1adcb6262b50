"""Measurements say when they were made; a team whose drives brake within its budget rests where it may."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.one_process import DirectExchange, simulate_apart
from coop_drake.answers import load_plan
from coop_drake.answers.budget import Budget
from coop_drake.apart.robot import StampCheck, certified_age
from coop_drake.cli.task import read_task
from coop_drake.scenario import Measurements
from coop_drake.simulation import build_maps
from tests.support.cli import invoke
from tests.support.same_runs import differences
from tests.support.sampled_team import sampled
from tests.support.scenarios import write_scenario
from tests.support.small_loop import small_maps

T = 0.005
BUDGET = Budget(control_rate=200.0, delay=0.012)


def asked(stamps, time=1.0, number=200, budget=BUDGET, age=0.01):
    return StampCheck(T, budget, age).doubts(number, time, stamps)


def test_measurements_are_as_old_as_the_robot_takes_them_for():
    assert certified_age(BUDGET) == pytest.approx(0.015)
    assert not asked((0.99, 0.99))
    assert not asked((0.0, 0.0), time=T, number=1)  # nothing is older than the start
    for stamps in ((0.985, 0.99), (0.99, 0.985), (0.995, 0.995), (1.005, 0.99), (0.9898, 0.99)):
        assert asked(stamps)
    assert not asked((0.5, 2.0), budget=None)


def test_no_more_than_the_budgets_delay_is_allowed():
    assert asked((0.98, 0.98), age=0.02)
    assert not asked((0.98, 0.98), age=0.02, budget=replace(BUDGET, delay=0.02))


def test_ages_may_be_wrong_by_the_error_of_the_clock_and_no_more():
    """The error of its clock may hide as much again, so that drives take what is older by twice the error."""
    wrong = replace(BUDGET, delay=0.01, clock_error=5e-4)
    assert certified_age(wrong) == pytest.approx(0.011)
    for late in (-5e-4, -2e-4, 0.0, 5e-4):
        assert not asked((0.99 - late, 0.99 - late), budget=wrong)
    for late in (-1e-3, -6e-4, 6e-4, 0.011):
        assert asked((0.99 - late, 0.99 - late), budget=wrong)
    assert asked((0.9902, 0.9898), budget=wrong)  # pose and state are measured at one instant
    assert asked((1.0006, 1.0006), budget=replace(wrong, delay=0.0), age=0.0)  # of the future
    assert not asked((1.0004, 1.0004), budget=replace(wrong, delay=0.0), age=0.0)
    nothing = float("nan")
    assert asked((nothing, nothing), budget=wrong)


def test_a_clock_that_drifts_beyond_its_error_is_seen_by_the_ages():
    check = StampCheck(T, replace(BUDGET, delay=0.01, clock_error=5e-4), 0.01)
    doubts = [check.doubts(k, (1.0 + 1e-4) * k * T, (k * T - 0.01,) * 2) for k in range(10, 2000)]
    first = doubts.index(True)
    assert 4.9 < first * T < 5.1
    assert all(doubts[first:])


@pytest.mark.parametrize(
    ("times", "jumps"),
    [((1.0, 1.005, 1.010), False), ((1.0, 1.005, 1.012), True), ((1.0, 1.005, 1.006), True)],
)
def test_a_clock_that_jumps_is_seen_by_the_numbers_of_samples(times, jumps):
    check = StampCheck(T, BUDGET, 0.01)
    doubts = [check.doubts(200 + k, time, (time - 0.01, time - 0.01)) for k, time in enumerate(times)]
    assert doubts == [False, False, jumps]


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
    return task.scenario, plan, maps


@pytest.mark.no_cover
@pytest.mark.slow
def test_whenever_the_drives_brake_the_team_rests_where_it_can_begin_a_cell_anew(transport):
    scenario, plan, maps = transport
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


class Watching(DirectExchange):
    """Keeps the time and the stamps of robot 0 at every sample."""

    def __init__(self):
        super().__init__()
        self.seen = []

    def step(self, time, measured, stamps=None):
        self.seen.append((time, *stamps[0]))
        return super().step(time, measured, stamps)


def test_stamps_are_set_when_measured_and_go_through_all_that_delays_or_loses_a_measurement():
    scenario, plan = sampled("base", measurements=Measurements(delay=0.02, loss=0.2))
    exchange = Watching()
    simulate_apart(scenario, plan, small_maps(), exchange=exchange)
    time, pose, state = np.array(exchange.seen).T
    for stamp in (pose, state):
        missing = np.maximum(time - 0.02, 0.0) - stamp
        assert (np.diff(stamp) >= 0.0).all()
        assert missing.min() >= -1e-12
        assert 0.7 < (missing < 1e-12).mean() < 0.9
        assert missing / 0.01 == pytest.approx(np.round(missing / 0.01), abs=1e-9)
    assert (pose != state).any()


def test_sensors_of_a_wrong_clock_measure_at_other_instants_and_their_stamps_say_so():
    scenario, plan = sampled("base", measurements=Measurements(delay=0.02), clock_error=0.004)
    exchange = Watching()
    log = simulate_apart(scenario, plan, small_maps(), exchange=exchange)
    assert log.reached
    time, pose, state = np.array(exchange.seen).T
    assert (pose == state).all()
    shift = -pose[0]
    assert 0.0 < abs(shift) <= 0.004
    np.testing.assert_allclose(pose, np.maximum(time - 0.02, 0.0) - shift, atol=1e-12)


class LateExchange(DirectExchange):
    """From a time on, every measurement is some samples older than it was before; its stamps say so."""

    def __init__(self, begin, samples):
        super().__init__([(10**6, 10**6)])  # drives brake where they have to, and the run goes on
        self.begin, self.samples, self.past = begin, samples, []

    def step(self, time, measured, stamps=None):
        self.past.append(([*measured], [*stamps]))
        late = self.samples if time >= self.begin else 0
        return super().step(time, *self.past[max(0, len(self.past) - 1 - late)])


@pytest.mark.slow
def test_a_team_whose_measurements_come_later_than_its_plan_allows_rests_and_says_why(transport):
    scenario, plan, maps = transport
    exchange = LateExchange(0.8, 3)
    log = simulate_apart(scenario, plan, maps, exchange=exchange)
    assert not log.reached
    assert "robot 0 and robot 1 cannot go on: measurements are older than the plan allows" in log.violation
    assert "without contact" in log.violation
    (stop,) = exchange.membership.stops
    assert 0.8 < stop.since < 0.88  # after a request for a hold; the monitor may be quicker
    assert np.abs(log.object_twist[-1]).max() < 0.05


def test_a_clock_that_is_more_wrong_than_the_plan_allows_is_seen_at_once(transport):
    scenario, plan, maps = transport
    wrong = replace(scenario, deployment=replace(scenario.deployment, clock_error=0.002))
    log = simulate_apart(wrong, plan, maps)
    assert not log.reached
    assert log.times[-1] < 0.2
    assert "lets the drives brake" in log.violation


class Hurried(DirectExchange):
    """Robot 1 has a clock that is ahead of the others'."""

    def _computed(self, time, measured, stamps):
        own = self.robots[1]
        right, own.step = own.step, lambda now, *args, **more: right(now + 1e-4, *args, **more)
        try:
            return super()._computed(time, measured, stamps)
        finally:
            own.step = right


def test_a_clock_that_is_wrong_within_the_budget_changes_no_nominal_motion(transport):
    scenario, plan, maps = transport
    scenario = replace(scenario, simulator=replace(scenario.simulator, max_time=1.0))
    allowed = replace(plan, budget=replace(plan.budget, clock_error=2e-4))
    logs = [simulate_apart(scenario, allowed, maps, exchange=one()) for one in (DirectExchange, Hurried)]
    assert logs[0].times[-1] == pytest.approx(1.0)
    assert differences(*logs) == []
    seen = simulate_apart(scenario, plan, maps, exchange=Hurried())
    assert seen.times[-1] < 0.2
