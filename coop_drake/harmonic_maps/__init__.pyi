from .field import Streamlines, VelocityField, trace_streamlines
from .harmonic_map import HarmonicMap, MapAccuracy, MapStore

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
