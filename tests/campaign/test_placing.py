"""The cluster that a campaign starts has the settings that the documentation states."""

import dask
import pytest

from coop_drake.campaign.execution import client_of


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


def test_workers_do_not_measure_themselves_at_short_intervals(client):
    def intervals(dask_worker):
        return {name: callback.callback_time for name, callback in dask_worker.periodic_callbacks.items()}

    (measured,) = client.run(intervals).values()
    assert not {"profile", "profile-cycle"} & measured.keys()
    assert (measured["tick"], measured["monitor"]) == (500.0, 5000.0)


def test_settings_of_the_users_own_stand_above():
    with dask.config.set({"distributed.scheduler.worker-ttl": "7s"}), client_of(1, None) as client:
        assert client.run_on_scheduler(lambda dask_scheduler: dask_scheduler.worker_ttl) == 7.0
