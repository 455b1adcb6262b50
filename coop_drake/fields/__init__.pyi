from .accuracy import MapAccuracy
from .harmonic_map import HarmonicMap
from .store import MapStore
from .streamlines import Streamlines, trace_streamlines
from .velocity_field import VelocityField

__all__ = [
    "HarmonicMap",
    "MapAccuracy",
    "MapStore",
    "Streamlines",
    "VelocityField",
    "trace_streamlines",
]
