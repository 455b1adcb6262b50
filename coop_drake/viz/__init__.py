"""Figures of the paper, and a transport in Meshcat: live, and as a recording."""

from coop_drake.answers import table_1
from coop_drake.viz.block_diagram import block_diagram_figure
from coop_drake.viz.effort_figures import summary_figure
from coop_drake.viz.figures import write_figures
from coop_drake.viz.live import LiveView
from coop_drake.viz.place_figures import path_figure
from coop_drake.viz.recording import inline_frame, recording_html, write_recording
from coop_drake.viz.scene import TransportScene
from coop_drake.viz.state_figures import angle_figure

__all__ = [
    "LiveView",
    "TransportScene",
    "angle_figure",
    "block_diagram_figure",
    "inline_frame",
    "path_figure",
    "recording_html",
    "summary_figure",
    "table_1",
    "write_figures",
    "write_recording",
]
