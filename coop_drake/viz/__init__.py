"""Figures of the paper, and a transport in Meshcat: live, and as a recording."""

from coop_drake.lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
