"""The benchmark of messages exchanges as many as it is told."""

import pytest

from benchmarks.messages import message_tasks, round_trip


@pytest.mark.parametrize("encrypted", [False, True])
def test_every_round_trip_takes_time(encrypted):
    wall, processor = round_trip(3, encrypted=encrypted)
    assert wall > 0.0
    assert processor > 0.0


def test_the_task_names_its_topic():
    assert [task.name for task in message_tasks()] == ["apart/cost/messages"]
