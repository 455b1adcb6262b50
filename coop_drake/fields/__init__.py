"""Harmonic maps of planar domains to the unit disk, and the velocity fields that they induce."""

from coop_drake.lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
