"""Harmonic maps of planar domains to the unit disk, and the velocity fields that they induce."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
