"""Harmonic maps of planar cells to the unit disk, and the velocity fields they induce."""

from coop_drake.fields.blunting import blunted
from coop_drake.fields.certificate import MapCertificate
from coop_drake.fields.cuts import cut_open
from coop_drake.fields.harmonic_map import HarmonicMap
from coop_drake.fields.store import MapStore
from coop_drake.fields.streamlines import Streamlines, trace_streamlines
from coop_drake.fields.velocity_field import VelocityField

__all__ = [
    "HarmonicMap",
    "MapCertificate",
    "MapStore",
    "Streamlines",
    "VelocityField",
    "blunted",
    "cut_open",
    "trace_streamlines",
]
