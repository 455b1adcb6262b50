"""Figures of the paper and Meshcat recordings of a run."""

from coop_drake.planning import table_1
from coop_drake.viz.figures import write_figures
from coop_drake.viz.recording import inline_frame, recording_html, write_recording

__all__ = ["inline_frame", "recording_html", "table_1", "write_figures", "write_recording"]
