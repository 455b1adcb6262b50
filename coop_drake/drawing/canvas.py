"""Figures and what is drawn on them: the style, floors and bodies on axes."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import AbstractContextManager
from io import BytesIO
from pathlib import Path
from textwrap import fill
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PathCollection
from matplotlib.colors import to_rgba_array
from matplotlib.figure import Figure
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path as Outline
from shapely import Polygon, box, get_coordinates
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from coop_drake.drawing.colours import FLOOR, GREY, INK, OBJECT, WALL, robot_colour
from coop_drake.drawing.solids import team_footprints
from coop_drake.files import write_atomically
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import ComponentTree

# Blank figures, captions and legends, drawn without pyplot's global state.

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


# Floors and bodies on axes.

# Drawing the floor plan and the team on it.

_RIM = 0.3
"""Width of the wall drawn around the floor [m]."""


def outline_of(rings: Iterable[FloatArray]) -> Outline:
    """Return one path of several closed rings, each of shape (n, 2) with its first point repeated at the end.

    Matplotlib leaves out what a ring encloses that runs the other way round.
    """
    return Outline.make_compound_path(*(Outline(ring, closed=True) for ring in rings))


def draw_polygon(ax: Axes, polygon: BaseGeometry, **style: Any) -> None:
    """Add a polygon, or a shape of several polygons, with its holes to ``ax``."""
    if not polygon.is_empty:
        ax.add_patch(PathPatch(outline_of(_rings(polygon)), **style))


def draw_workspace(ax: Axes, workspace: Polygon) -> None:
    """Draw the floor white, everything else as wall, and set equal axes in metres."""
    frame = frame_of(workspace)
    draw_polygon(ax, box(*frame), facecolor=WALL, edgecolor="none", zorder=0)
    draw_polygon(ax, workspace, facecolor=FLOOR, edgecolor=INK, linewidth=1.0, zorder=1)
    ax.set(xlim=frame[::2], ylim=frame[1::2], aspect="equal", xlabel="x [m]", ylabel="y [m]")


def frame_of(workspace: Polygon) -> tuple[float, float, float, float]:
    """Return the limits (x_min, y_min, x_max, y_max) of a picture of the floor with a rim of wall [m]."""
    x_min, y_min, x_max, y_max = workspace.bounds
    return x_min - _RIM, y_min - _RIM, x_max + _RIM, y_max + _RIM


def draw_team(
    ax: Axes,
    tree: ComponentTree,
    configuration: FloatArray,
    *,
    colour: Any = None,
    alpha: float = 0.55,
    zorder: float = 3.0,
) -> None:
    """Draw every body's footprint at z = (x, y, theta, q...), shape (3 + n,) [m, rad].

    Bodies have one colour, or by default the object's and each robot's own; ``alpha`` is that of the filling.
    """
    footprints = team_footprints(tree, configuration)
    own = [OBJECT if body.robot is None else robot_colour(body.robot) for body in footprints]
    edges = own if colour is None else [colour] * len(footprints)
    outlines = [outline_of(_rings(body.shape)) for body in footprints]
    bodies = PathCollection(
        outlines, facecolors=to_rgba_array(edges, alpha), edgecolors=edges, linewidths=0.9, zorder=zorder
    )
    ax.add_collection(bodies)


def _rings(shape: BaseGeometry) -> list[FloatArray]:
    """Return outer rings of polygons anticlockwise and their holes clockwise, each of shape (n, 2) [m]."""
    parts = [orient(part) for part in getattr(shape, "geoms", [shape])]
    return [get_coordinates(ring) for part in parts for ring in (part.exterior, *part.interiors)]


def team_legend(tree: ComponentTree) -> list[Patch]:
    """Return legend entries that say which colour is the object's and which each robot's."""
    names = {
        body.robot: body.name.split("::")[0] for component in tree.components for body in component.bodies
    }
    robots = sorted(robot for robot in names if robot is not None)
    return [
        Patch(color=OBJECT, alpha=0.55, label="object"),
        *(Patch(color=robot_colour(robot), alpha=0.55, label=names[robot]) for robot in robots),
    ]
