"""Settings of all tests: the same examples on every machine, so that a failure seen once is seen again."""

from hypothesis import settings

settings.register_profile("reproducible", derandomize=True, deadline=None)
settings.load_profile("reproducible")
