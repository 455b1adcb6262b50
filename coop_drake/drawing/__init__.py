"""Floor plans, footprints, meshes and blank figures: what every picture is drawn with."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
