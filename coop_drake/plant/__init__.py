"""Plants made of the scenario's models, and the component tree read from their collision geometry."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
