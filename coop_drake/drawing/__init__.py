"""Floor plans, footprints, meshes and blank figures: what every picture is drawn with."""

from coop_drake.lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
