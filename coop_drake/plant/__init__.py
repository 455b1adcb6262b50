"""Plants made of the scenario's models, and the component tree read from their collision geometry."""

from coop_drake.lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
