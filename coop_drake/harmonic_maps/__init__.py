"""Harmonic maps of planar domains to the unit disk, and the velocity fields that they induce."""

from coop_drake.lazy import lazy_names

TOLERANCE = 1e-8
"""Largest estimated error of a map that is accepted, if none is given, in units of the disk's radius [-]."""

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
