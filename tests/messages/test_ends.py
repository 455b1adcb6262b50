"""A world, a supervisor and two robots in one process exchange messages through real sockets."""

from collections.abc import Iterator

import pytest

from coop_drake.errors import MessagingError
from coop_drake.messages import (
    SUPERVISOR,
    WORLD,
    Effort,
    Goodbye,
    Present,
    Question,
    Ready,
    RobotEnd,
    Sample,
    Status,
    SupervisorEnd,
    Switch,
    Tick,
    WorldEnd,
    local_book,
    make_keys,
)

QUESTION = Question(1, 2)

LIMIT = 10.0
"""Longest time that a test waits for what must come [s]."""


class Team:
    """All ends of a team of two robots, with or without keys."""

    def __init__(self, secured: bool, question: Question = QUESTION) -> None:
        self.keys = {k: make_keys() for k in (0, 1, SUPERVISOR, WORLD)} if secured else {}
        self.book = local_book(2, self.keys)
        self.shown: list[tuple[str, int, bytes]] = []
        self.world = WorldEnd(self.book, question, self.keys.get(WORLD))
        self.supervisor = SupervisorEnd(
            self.book, question, self.keys.get(SUPERVISOR), lambda *shown: self.shown.append(shown)
        )
        self.robots = [RobotEnd(self.book, k, question, self.keys.get(k)) for k in range(2)]

    @property
    def ends(self):
        return [self.world, self.supervisor, *self.robots]

    def open(self) -> None:
        """Let each end poll in turn until all have sessions; the tests have one thread."""
        for _ in range(int(LIMIT / 0.01)):
            for end in self.ends:
                while (taken := end.receive(0.001)) is not None:
                    assert isinstance(taken[1], Present)
            present = self.world.present() == {0, 1, SUPERVISOR}
            if present and all(peer.session for peer in self.supervisor.team.peers.values()):
                return
        raise AssertionError([end.refusals.counts for end in self.ends])


@pytest.fixture(params=[False, True], ids=["open", "secured"])
def team(request) -> Iterator[Team]:
    team = Team(request.param)
    team.open()
    yield team
    for end in team.ends:
        end.close()


def test_samples_and_efforts_cross_in_lock_step(team):
    for number in range(1, 6):
        for k, robot in enumerate(team.robots):
            sample = Sample(
                number, 0.005 * number, True, False, 0, 0.0, 0.0, (1.0, 2.0, 0.5), (float(k), *range(9))
            )
            assert team.world.send(k, sample)
            sender, heard = robot.receive(LIMIT)
            assert (sender, heard) == (WORLD, sample)
            robot.efforts.send(
                Effort(heard.number, heard.pose_stamp, robot.team.sent, 0, (0.1 * k, -1.0, 2.0))
            )
        efforts = dict(team.world.receive(LIMIT) for _ in range(2))
        assert [efforts[k].efforts[0] for k in range(2)] == [0.0, 0.1]
    assert all(end.refusals.total == 0 for end in team.ends)


def test_the_teams_channel_carries_reports_and_switches(team):
    for robot in team.robots:
        assert robot.team.send(Ready(3, True))
    heard = dict(team.supervisor.receive(LIMIT) for _ in range(2))
    assert heard == {0: Ready(3, True), 1: Ready(3, True)}
    assert team.supervisor.send_to_all(Switch(4, 300)) == [0, 1]
    assert [robot.receive(LIMIT) for robot in team.robots] == [(SUPERVISOR, Switch(4, 300))] * 2
    # What each side has sent is what the other one has: lock-step waits for these numbers.
    assert [robot.team.sent for robot in team.robots] == [2, 2]
    assert [peer.incoming.last for peer in team.supervisor.team.peers.values()] == [2, 2]
    assert len([data for way, _, data in team.shown if way == "sent"]) == 4  # Two welcomes, two switches.


def test_the_supervisor_has_the_worlds_channels_like_a_robot(team):
    team.world.send(SUPERVISOR, Tick(7, 0.035, True, False, (1, 1)))
    assert team.supervisor.receive(LIMIT) == (WORLD, Tick(7, 0.035, True, False, (1, 1)))
    status = Status(7, 0.035, True, (0, 0), 2, 0.01, False, (0, 2, 3), 4)
    team.supervisor.efforts.send(status)
    assert team.world.receive(LIMIT) == (SUPERVISOR, status)
    team.world.send(SUPERVISOR, Goodbye(0))
    assert team.supervisor.receive(LIMIT) == (WORLD, Goodbye(0))


def test_who_does_not_come_is_named_on_both_sides():
    team = Team(False)
    try:
        with pytest.raises(
            MessagingError, match=r"came from robot 0, robot 1, the supervisor \(waited for 0.05 s\)"
        ):
            team.world.open(0.05)
        team.world.close()
        with pytest.raises(
            MessagingError, match=r"the world at tcp://127.0.0.1:\d+: nothing answers there; .* the sup"
        ):
            team.robots[0].open(0.05)
    finally:
        for end in team.ends:
            end.close()
