"""Run a scenario: the simulation, its log, and the invariants checked while it runs."""

from coop_drake.lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
