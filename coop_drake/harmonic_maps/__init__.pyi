from .field import Streamlines, VelocityField, trace_streamlines
from .harmonic_map import HarmonicMap, MapAccuracy
from .store import MapStore

TOLERANCE: float

__all__ = [
    "TOLERANCE",
    "HarmonicMap",
    "MapAccuracy",
    "MapStore",
    "Streamlines",
    "VelocityField",
    "trace_streamlines",
]
