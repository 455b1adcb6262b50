"""The cluster that a campaign starts has the settings that the documentation states."""

import dask
import pytest

from coop_drake.campaign.running.placing import client_of


@pytest.fixture(scope="module")
def client():
    with client_of(1, None) as client:
        yield client


def test_a_silent_worker_is_given_up_after_a_minute_and_a_batch_is_tried_a_hundred_times_more(client):
    kept = client.run_on_scheduler(
        lambda dask_scheduler: (dask_scheduler.worker_ttl, dask_scheduler.allowed_failures)
    )
    assert kept == (60.0, 100)


@pytest.mark.parametrize(
    ("name", "value"), [("worker.profile.enabled", False), ("admin.tick.interval", "500ms")]
)
def test_workers_do_not_measure_themselves_at_short_intervals(client, name, value):
    assert client.submit(lambda: dask.config.get(f"distributed.{name}")).result() == value


def test_settings_of_the_users_own_stand_above():
    with dask.config.set({"distributed.scheduler.worker-ttl": "7s"}), client_of(1, None) as client:
        assert client.run_on_scheduler(lambda dask_scheduler: dask_scheduler.worker_ttl) == 7.0
