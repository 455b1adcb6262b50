"""The benchmark of campaigns looks at what it says."""

import pytest

from benchmarks.campaign_costs import campaign_tasks, placing, worker_memory
from benchmarks.isolated import WorkerError
from benchmarks.rows import Row


@pytest.mark.slow
def test_a_worker_has_a_size_after_every_batch():
    sizes = worker_memory(2, 1)
    assert len(sizes) == 2
    assert all(size > 10.0 for size in sizes)


@pytest.mark.slow
def test_empty_batches_cost_something():
    rows = placing(5)
    assert [row.name for row in rows] == [
        "campaign/scheduler/empty_batch/cpu",
        "campaign/scheduler/empty_batch/wall",
    ]
    assert all(row.value > 0.0 for row in rows)


def test_the_tasks_name_their_topic():
    assert {task.name.split("/")[0] for task in campaign_tasks()} == {"campaign"}


def test_the_largest_cluster_follows_from_what_was_measured():
    (cluster,) = (task for task in campaign_tasks() if task.name == "campaign/cluster")
    measured = [
        Row("campaign/scheduler/empty_batch/cpu", 0.8, "ms"),
        Row("campaign/batches/process/start", 0.9, "CPU s"),
    ]
    batch, cores = cluster.measure(measured)
    assert batch.value == pytest.approx(90.0)
    assert cores.value == pytest.approx(90.0 / 0.8e-3)
    with pytest.raises(WorkerError, match="measure them first"):
        cluster.measure(measured[:1])
