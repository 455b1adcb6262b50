"""Settings of all tests: the same examples on every machine, so that a failure seen once is seen again."""

import os

import pytest
from hypothesis import settings

settings.register_profile("reproducible", derandomize=True, deadline=None)
settings.load_profile("reproducible")


@pytest.fixture(scope="session", autouse=True)
def own_map_cache(tmp_path_factory):
    """Leave the user's cache alone, also in processes that tests start."""
    os.environ["COOP_DRAKE_CACHE"] = str(tmp_path_factory.mktemp("cache"))
