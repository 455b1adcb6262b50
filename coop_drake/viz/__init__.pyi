from .block_diagram import block_diagram_figure
from .figures import angle_figure, path_figure, summary_figure, write_figures
from .live import LivePage, LiveView
from .recording import inline_frame, recording_html, write_recording
from .scene import TransportScene

__all__ = [
    "LivePage",
    "LiveView",
    "TransportScene",
    "angle_figure",
    "block_diagram_figure",
    "inline_frame",
    "path_figure",
    "recording_html",
    "summary_figure",
    "write_figures",
    "write_recording",
]
