"""Settings of all tests: the same examples on every machine, so that a failure seen once is seen again."""

import gc
import os

# The matrices are small: threads of BLAS would get into each other's way, and change the order of sums.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import pytest
from hypothesis import HealthCheck, settings

# Limits of time would fail on a busy machine.
settings.register_profile(
    "reproducible", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("reproducible")

# What is collected lives as long as the session.
gc.disable()


@pytest.fixture(scope="session", autouse=True)
def own_map_cache(tmp_path_factory):
    """Leave the user's cache alone, also in processes that tests start."""
    os.environ["COOP_DRAKE_CACHE"] = str(tmp_path_factory.mktemp("cache"))


def pytest_collection_finish():
    """Let the garbage collector look only at what comes from now on."""
    gc.freeze()
    gc.enable()
