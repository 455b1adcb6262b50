"""Results that are damaged are named, and the cluster of a campaign has the settings that are documented."""

import dask
import pytest

from coop_drake.campaign.execution import client_of
from coop_drake.campaign.records import Batch, CampaignFolder, RunRecord
from coop_drake.errors import CoopDrakeError


@pytest.fixture
def folder_and_batch(tmp_path):
    folder, batch = CampaignFolder(tmp_path), Batch(0, "compiled", 0, 2, "0" * 64)
    run = RunRecord(0, "base", "compiled", 1, "{}", False, "left its cell")
    folder.write(batch, [run, run])
    return folder, batch


def test_a_file_that_is_damaged_inside_is_named_with_what_to_do(folder_and_batch):
    folder, batch = folder_and_batch
    file = folder.path / batch.file
    content = bytearray(file.read_bytes())
    content[4:200] = bytes(196)  # The end, which says how many rows there are, is whole.
    file.write_bytes(content)
    assert folder.has(batch)
    with pytest.raises(CoopDrakeError, match=r"0\.parquet is damaged \(.*\); remove it, and"):
        folder.table([batch])


def test_a_file_without_its_end_counts_as_missing(folder_and_batch):
    folder, batch = folder_and_batch
    file = folder.path / batch.file
    file.write_bytes(file.read_bytes()[:-20])
    assert folder.missing([batch]) == [batch]


def test_costs_that_cannot_be_read_are_not_counted(folder_and_batch):
    folder, batch = folder_and_batch
    folder.note(batch, {"runs": 2, "cpu_seconds": 1.0})
    assert folder.cpu_seconds([batch]) == 0.5
    (folder.path / batch.costs).write_text("")
    assert folder.costs([batch]) == []


@pytest.fixture(scope="module")
def client():
    with client_of(1, None) as client:
        yield client


def test_a_silent_worker_is_given_up_in_a_minute_and_a_batch_is_tried_a_hundred_times_more(client):
    kept = client.run_on_scheduler(
        lambda dask_scheduler: (
            dask_scheduler.worker_ttl,
            dask_scheduler.periodic_callbacks["worker-ttl"].callback_time,
            dask_scheduler.allowed_failures,
        )
    )
    assert kept == (30.0, 30_000.0, 100)


def test_settings_of_the_users_own_stand_above():
    with dask.config.set({"distributed.scheduler.worker-ttl": "7s"}), client_of(1, None) as client:
        assert client.run_on_scheduler(lambda dask_scheduler: dask_scheduler.worker_ttl) == 7.0
