"""Blank figures, captions and legends, drawn without pyplot's global state."""

from __future__ import annotations

from contextlib import AbstractContextManager
from io import BytesIO
from pathlib import Path
from textwrap import fill
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from coop_drake.drawing.colours import GREY
from coop_drake.files import write_atomically

_STYLE: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.alpha": 0.3,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "lines.solid_joinstyle": "round",
}


_AXIS_LABELS = 0.54
"""Height of the ticks and the label of a horizontal axis, and of the gap to the caption [in]."""

_CAPTION_LINE = 0.17
"""Height of a line of a caption, whose letters have 9 points [in]."""


DPI = 120.0
"""Resolution of pictures [1/in]: sharp on a screen, at a tenth of a megabyte a figure."""

_COMPRESSION = 3
"""Effort of compressing PNG, 0 to 9: files are a fifth larger than at 6, and take half the time."""


def house_style() -> AbstractContextManager[None]:
    """Return a context in which figures are drawn in the common style; it ends with the old one."""
    return mpl.rc_context(_STYLE)


def new_figure(
    width: float, height: float, caption: str, *, margins: tuple[float, float, float] | None = None
) -> Figure:
    """Return an empty figure [in] with its caption underneath, broken into lines that fit the width.

    ``margins`` are the spaces for labels at the left, at the right and at the top of the axes [in]; the space
    below them follows from the caption. By default the labels are measured, which costs as much as drawing
    the figure two more times.
    """
    figure = Figure(figsize=(width, height), layout=None if margins else "constrained")
    FigureCanvasAgg(figure)
    if margins is None:
        figure.supxlabel(_broken(caption, width), fontsize=9, x=0.02, ha="left", color=GREY)
    else:
        set_margins(figure, caption, margins)
    return figure


def set_margins(figure: Figure, caption: str, margins: tuple[float, float, float]) -> None:
    """Write the caption under a figure of its final size, and keep the margins of ``new_figure`` [in]."""
    (width, height), (left, right, top) = figure.get_size_inches(), margins
    lines = _broken(caption, width)
    below = _AXIS_LABELS + _CAPTION_LINE * (1 + lines.count("\n"))
    figure.subplots_adjust(left / width, below / height, 1.0 - right / width, 1.0 - top / height)
    figure.text(0.02, 0.05 / height, lines, fontsize=9, ha="left", va="bottom", color=GREY)


def _broken(caption: str, width: float) -> str:
    """A caption in lines that fit a width [in]."""
    return fill(caption, int(15 * width))


def legend_above(ax: Axes, handles: list[Patch] | None = None) -> None:
    """Put the legend in one row above the axes, where it hides nothing."""
    entries = handles if handles is not None else ax.get_legend_handles_labels()[0]
    ax.legend(
        handles=entries, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(entries), borderpad=0.1
    )


def save_figure(figure: Figure, path: Path, *, dpi: float = DPI) -> None:
    """Write a figure, whole or not at all: PNG of ``dpi`` points per inch, or SVG if the path ends so."""
    write_atomically(path, picture_of(figure, path.suffix, dpi=dpi))


def picture_of(figure: Figure, ending: str = ".png", *, dpi: float = DPI) -> bytes:
    """Return what `save_figure` writes. The same figure gives the same bytes."""
    options: dict[str, Any] = {"format": "png", "pil_kwargs": {"compress_level": _COMPRESSION}}
    if ending == ".svg":
        options = {"format": "svg", "metadata": {"Date": None}}
    file = BytesIO()
    with mpl.rc_context({"svg.hashsalt": "coop_drake"}):
        figure.savefig(file, dpi=dpi, **options)
    return file.getvalue()
