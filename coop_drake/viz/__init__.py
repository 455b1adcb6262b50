"""Figures of the paper, and a transport in Meshcat: live, and as a recording."""

from coop_drake.planning import table_1
from coop_drake.viz.figures import write_figures
from coop_drake.viz.live import LiveView
from coop_drake.viz.recording import inline_frame, recording_html, write_recording
from coop_drake.viz.scene import TransportScene

__all__ = [
    "LiveView",
    "TransportScene",
    "inline_frame",
    "recording_html",
    "table_1",
    "write_figures",
    "write_recording",
]
