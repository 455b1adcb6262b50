"""Run a scenario: the simulation, its log, and the invariants checked while it runs."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
