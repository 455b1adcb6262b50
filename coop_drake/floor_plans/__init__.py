"""Reads drawings and occupancy maps as workspaces; their formats stand in `formats.py`."""

from coop_drake.lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
