"""Random planning questions, how their answers are judged, and other planners that try to refute them."""

from coop_drake.lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
