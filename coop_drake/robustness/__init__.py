"""Bounds of what departs under a budget, for the planner, which chooses, and the verifier, which checks."""

from coop_drake.lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
