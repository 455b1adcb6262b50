"""Robots and supervisor as nodes without sockets: what they say, how old measurements may be, whole runs."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.one_process import DirectExchange, simulate_apart
from coop_drake.answers.budget import Budget
from coop_drake.apart import RobotNode, SupervisorNode
from coop_drake.apart.messages import AtRest, Begin, Place, Ready, Switch
from coop_drake.apart.node import ASKS, FOLLOWS, OUTSIDE, RETURNS, STANDS
from coop_drake.apart.processes import SPARE
from coop_drake.apart.robot import StampCheck, certified_age
from coop_drake.diagram import build_station, control_period
from coop_drake.diagram.robot_controller import robot_knowledge
from coop_drake.errors import ScenarioError
from coop_drake.scenario import Measurements, RobotDepartures
from tests.support.small_loop import sampled, small_maps

PERIOD = 0.01


@pytest.fixture
def robots():
    scenario, plan = sampled("base")
    team = build_station(scenario).team
    known = robot_knowledge(scenario, plan, small_maps(), team)
    nodes = [RobotNode(own, scenario.deployment, k, team.robots[k].name) for k, own in enumerate(known)]
    yield nodes
    for node in nodes:
        node.release()


@pytest.fixture
def supervisor():
    node = SupervisorNode(2, 3, PERIOD, None)
    yield node
    node.release()


def at_start(object_pose=None, rate=0.0):
    """What robot 0 measures at the plan's start, or with another pose of the object."""
    _, plan = sampled("base")
    own = [*plan.start[:3], plan.start[3]]
    return np.array([*own, *[rate] * 4, *(plan.start[:3] if object_pose is None else object_pose)])


def stand(node, measured, samples, first=0):
    """What a robot says while its drives brake."""
    said = []
    for k in range(first, first + samples):
        effort, more = node.step(k * PERIOD, measured, stopped=True)
        assert not effort.any()
        said += more
    return said


def test_a_robot_at_rest_says_so_ten_times_a_second_and_begins_at_the_ordered_sample(robots):
    node, measured = robots[0], at_start()
    said = stand(node, measured, 61)
    assert node.state == STANDS
    assert [message.sample for message in said] == [39, 49, 59]  # It has seen rest for 0.3 s before.
    assert all(message.object_pose == pytest.approx(measured[-3:], abs=1e-12) for message in said)
    pose = (measured[-3] + 0.001, measured[-2], measured[-1])
    needed = said[0].needed
    assert needed > 50
    node.hear([Begin(0, 63, needed, pose)])
    stand(node, measured, 2, 61)
    for k in range(63, 63 + needed):
        node.step(k * PERIOD, measured, stopped=k == 63)
        assert node.state == RETURNS
        assert node.place == Place(True, 0, 63)
        assert node.look(k * PERIOD, measured)[:2] == pytest.approx(pose[:2], abs=1e-12)
    node.step((63 + needed) * PERIOD, measured)
    assert node.state == FOLLOWS


def test_an_order_counts_in_the_turn_that_the_robot_knows(robots):
    """Another robot, started again, may have counted other turns of the object's angle."""
    node, measured, efforts = robots[0], at_start(), []
    for turns in (0, 1, -3):
        begin = 100 * len(efforts)
        stand(node, measured, 31, begin)
        node.hear([Begin(0, begin + 31, 80, (*measured[-3:-1], measured[-1] + 2.0 * np.pi * turns))])
        effort, _ = node.step((begin + 31) * PERIOD, measured, stopped=True)
        assert node.state == RETURNS
        efforts.append(effort)
    np.testing.assert_allclose(efforts[1:], [efforts[0]] * 2, atol=1e-6)


def test_wrong_values_do_not_count_turns(robots):
    node, measured = robots[0], at_start()
    for number, off in enumerate((0.0, -2.8, -5.6, -8.4, np.nan)):
        node.step(number * PERIOD, np.where(np.arange(11) == 10, measured + off, measured), stopped=True)
    np.testing.assert_allclose(node._unwrapped(measured), measured, atol=1e-12)


def test_a_robot_that_hears_the_order_too_late_stands_on(robots):
    node, measured = robots[0], at_start()
    stand(node, measured, 20)
    node.hear([Begin(0, 15, 80, (0.0, 0.0, 0.0))])
    assert stand(node, measured, 40, 20)
    assert node.state == STANDS


def test_a_robot_that_moves_or_stands_outside_its_cell_does_not_say_that_it_rests(robots):
    node = robots[0]
    assert not stand(node, at_start(rate=0.5), 30)
    assert node.state == STANDS
    assert not stand(node, at_start((50.0, 50.0, 0.0)), 50, 30)
    assert node.state == OUTSIDE


def test_a_robot_that_was_started_again_does_nothing_until_it_knows_the_cell(robots):
    node, measured = robots[0], at_start()
    node.forget()
    for stopped in (False, True):
        effort, said = node.step(0.5, measured, stopped=stopped)
        assert (effort.any(), said, node.state) == (False, [], ASKS)
    node.hear([Switch(1, 40)])
    assert node.state == STANDS
    assert node.place == Place(True, 1, 40)
    node.step(0.51, measured)
    assert node.state in (STANDS, OUTSIDE)


def test_the_supervisor_orders_once_all_have_said_that_they_rest_since_the_drives_brake(supervisor):
    supervisor.hear(0, [AtRest(3, 40, (1.0, 2.0, 0.5))])
    assert supervisor.step(5 * PERIOD, stopped=True) == []
    supervisor.hear(1, [AtRest(16, 60, (1.1, 2.1, 0.6))])
    assert supervisor.step(17 * PERIOD, stopped=True) == []
    supervisor.hear(0, [AtRest(17, 50, (1.2, 2.2, 0.7))])
    (order,) = supervisor.step(18 * PERIOD, stopped=True)
    assert (order.cell, order.sample, order.slow) == (0, 29, 60 + SPARE)
    assert order.object_pose == pytest.approx((1.15, 2.15, 0.65))
    for k in range(19, 29):
        assert supervisor.step(k * PERIOD, stopped=True) == []
    assert supervisor.step(29 * PERIOD, stopped=True) == []
    assert supervisor.look(29 * PERIOD)[:2] == pytest.approx([0.0, 0.29])
    supervisor.step(30 * PERIOD, stopped=True)  # Somebody has not begun: all report rest once more.
    supervisor.hear(0, [AtRest(40, 70, (1.2, 2.2, 0.7))])
    supervisor.hear(1, [AtRest(40, 70, (1.2, 2.2, 0.7))])
    assert supervisor.step(41 * PERIOD, stopped=True) == [Begin(0, 52, 70 + SPARE, (1.2, 2.2, 0.7))]


def test_a_supervisor_that_was_started_again_learns_the_latest_cell_from_all_robots(supervisor):
    supervisor.forget()
    supervisor.hear(0, [Place(True, 1, 30), Ready(1, True)])
    assert (supervisor.answers(), supervisor.step(0.5), supervisor.knows) == ([], [], False)
    supervisor.hear(1, [Place(True, 0, 0)])
    assert supervisor.answers() == [(0, Switch(1, 30)), (1, Switch(1, 30))]
    assert supervisor.knows
    assert supervisor.look(0.5)[:2] == pytest.approx([1.0, 0.3])
    for k in range(2):
        supervisor.hear(k, [Ready(1, True)])
    assert supervisor.step(0.51) == [Switch(2, 51)]
    supervisor.hear(1, [Place(False, 0, 0)])
    assert supervisor.answers() == [(1, Switch(2, 51))]


def test_what_does_not_fit_is_left_aside(supervisor, robots):
    supervisor.hear(0, [Place(True, 9, 0), AtRest(5, 1, (1.0,))])
    assert supervisor.answers() == []
    robots[0].hear([Begin(9, 12, 40, (0.0, 0.0, 0.0)), Begin(0, 12, 40, (0.0,)), Switch(9, 12)])
    assert robots[0].place == Place(True, 0, 0)
    stand(robots[0], at_start(), 20)
    assert robots[0].state == STANDS


def test_a_new_cell_is_sent_in_further_samples_once_a_robot_has_missed_one(supervisor):
    def switched(cell, at):
        for k in range(2):
            supervisor.hear(k, [Ready(cell, True)])
        return [supervisor.step((at + k) * PERIOD) for k in range(5)]

    first, second = Switch(1, 10), Switch(2, 20)
    assert switched(0, 10) == [[first], [], [], [], []]
    supervisor.hear(0, [Ready(0, True)])
    assert supervisor.answers() == [(0, first)]
    assert switched(1, 20) == [[second], [second], [second], [second], []]


def test_a_report_that_crosses_a_new_cell_is_not_answered(supervisor):
    for k in range(2):
        supervisor.hear(k, [Ready(0, True)])
    assert supervisor.step(10 * PERIOD) == [Switch(1, 10)]
    supervisor.hear(0, [Ready(0, False)])
    assert supervisor.answers() == []


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


@pytest.mark.parametrize(("last", "jumps"), [(1.010, False), (1.012, True), (1.006, True)])
def test_a_clock_that_jumps_is_seen_by_the_numbers_of_samples(last, jumps):
    check = StampCheck(T, BUDGET, 0.01)
    doubts = [check.doubts(200 + k, t, (t - 0.01, t - 0.01)) for k, t in enumerate((1.0, 1.005, last))]
    assert doubts == [False, False, jumps]


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


def test_robots_apart_compute_at_common_samples():
    offset = {"robot_0": RobotDepartures(sample_offset=0.001)}
    with pytest.raises(ScenarioError, match="sample_offset"):
        control_period(sampled("base", robots=offset)[0])
