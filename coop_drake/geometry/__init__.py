"""Shapes of the floor and of the team: component tree, conservative sweeps, free space, tidy cells."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
