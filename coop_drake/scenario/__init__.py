"""Scenario files: their dataclasses, loading, checking and writing."""

from coop_drake.lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
