"""Every topic of the benchmark has its tasks, each of a name of its own."""

from benchmarks.app import _tasks
from benchmarks.planner.head_to_head import Effort
from benchmarks.table import TOPICS


def test_every_topic_of_the_help_has_tasks_of_their_own_names():
    names = [task.name for task in _tasks(Effort())]
    assert len(set(names)) == len(names)
    assert {name.partition("/")[0] for name in names} == {*TOPICS}
