"""Shapes of the floor and of the team: component tree, conservative sweeps, free space, tidy cells."""

from coop_drake.lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
