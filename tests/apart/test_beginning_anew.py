"""What robots and supervisor say to each other before a team begins its cell anew: nodes without sockets."""

import numpy as np
import pytest

from coop_drake.apart import RobotNode, SupervisorNode
from coop_drake.apart.messages import AtRest, Begin, Place, Ready, Switch
from coop_drake.apart.node import ASKS, FOLLOWS, OUTSIDE, RETURNS, STANDS
from coop_drake.apart.supervisor import SPARE
from coop_drake.diagram import build_station
from coop_drake.diagram.knowledge import robot_knowledge
from tests.support.sampled_team import sampled
from tests.support.small_loop import small_maps

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
    for k in range(63, 63 + needed):  # No plan with a budget: the way is not proved free.
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
    supervisor.hear(0, [AtRest(3, (), 40, (1.0, 2.0, 0.5))])
    assert supervisor.step(5 * PERIOD, stopped=True) == []
    supervisor.hear(1, [AtRest(16, (), 60, (1.1, 2.1, 0.6))])
    assert supervisor.step(17 * PERIOD, stopped=True) == []
    supervisor.hear(0, [AtRest(17, (), 50, (1.2, 2.2, 0.7))])
    (order,) = supervisor.step(18 * PERIOD, stopped=True)
    assert (order.cell, order.sample, order.slow) == (0, 29, 60 + SPARE)
    assert order.object_pose == pytest.approx((1.15, 2.15, 0.65))
    for k in range(19, 29):
        assert supervisor.step(k * PERIOD, stopped=True) == []
    assert supervisor.step(29 * PERIOD, stopped=True) == []
    assert supervisor.look(29 * PERIOD)[:2] == pytest.approx([0.0, 0.29])
    supervisor.step(30 * PERIOD, stopped=True)  # Somebody has not begun: all report rest once more.
    supervisor.hear(0, [AtRest(40, (), 70, (1.2, 2.2, 0.7))])
    supervisor.hear(1, [AtRest(40, (), 70, (1.2, 2.2, 0.7))])
    assert supervisor.step(41 * PERIOD, stopped=True) == [Begin(0, 52, 70 + SPARE, (1.2, 2.2, 0.7))]


@pytest.mark.parametrize(
    ("cells", "chosen"),
    [([(0, 1, 2), (1, 2)], 1), ([(0, 1), (0,)], 0), ([(2,), (1, 2)], 2), ([(1,), (2,)], 1)],
)
def test_the_team_begins_a_cell_that_holds_all_robots_the_present_one_where_it_does(
    supervisor, cells, chosen
):
    for k in range(2):
        supervisor.hear(k, [Ready(0, True)])
    supervisor.step(2 * PERIOD)
    supervisor.step(5 * PERIOD, stopped=True)
    for k, own in enumerate(cells):
        supervisor.hear(k, [AtRest(16, own, 60, (1.0, 2.0, 0.5))])
    (order,) = supervisor.step(17 * PERIOD, stopped=True)
    assert order.cell == chosen


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
    supervisor.hear(0, [Place(True, 9, 0), AtRest(5, (), 1, (1.0,))])
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
