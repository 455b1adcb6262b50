"""Draws the closed loop and one robot's controller as block diagrams, port to port."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch, PathPatch
from matplotlib.path import Path

from coop_drake.diagram import TELEMETRY, ClosedLoop
from coop_drake.drawing.canvas import house_style, new_figure
from coop_drake.drawing.colours import (
    BLOCK_OF_DIAGRAM,
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PAPER,
    PURPLE,
    SKY,
    VERMILLION,
)
from coop_drake.viz.signal_flow import INPUTS, OUTPUTS, DiagramBlock, Signal, SignalFlow, signal_flow

_ROW, _TITLE, _WIDTH, _GAP, _SPACE = 0.22, 0.42, 2.3, 0.9, 0.25
"""Heights of a port and of a title, width of a block, gaps between columns and between blocks [in]."""

_COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY)
Point = tuple[float, float]


@dataclass(frozen=True)
class _Place:
    """Where a block is drawn: its left edge, its top and its height [in]."""

    x: float
    y: float
    height: float

    def port(self, row: int) -> float:
        """Return the height of the middle of a port's row [in]."""
        return self.y - _TITLE - _ROW * (row + 0.5)


def block_diagram_figure(loop: ClosedLoop, robot: int = 0) -> Figure:
    """Draw the whole loop, and below it the controller of one robot.

    Raises:
        IndexError: The team has no such robot.
    """
    if not 0 <= robot < len(loop.bare_controllers):
        raise IndexError(f"robot {robot} is not in the team of {len(loop.bare_controllers)}")
    flows = (
        signal_flow(loop.diagram, "Closed loop: between robots only ready reports cross"),
        signal_flow(
            loop.bare_controllers[robot], f"Controller of robot {robot}", telemetry=frozenset(TELEMETRY)
        ),
    )
    places = [_places(flow) for flow in flows]
    extents = [_extent(found) for found in places]
    width = max(right for right, _ in extents)
    caption = "Blocks as they are wired in Drake, inputs at the left, outputs at the right of each."
    with house_style():
        figure = new_figure(width + 0.8, sum(height for _, height in extents) + 1.6, caption)
        panels = figure.subplots(2, 1, height_ratios=[height + 0.5 for _, height in extents])
        for ax, flow, found, (_, height) in zip(panels, flows, places, extents, strict=True):
            _draw(ax, flow, found, width, height)
    return figure


def _places(flow: SignalFlow) -> dict[str, _Place]:
    """Place blocks, and wires that pass a column, in columns; in each, in the order of what feeds them."""
    places: dict[str, _Place] = {}
    wires = _wires(flow)
    columns = range(1 + max(block.column for block in flow.blocks))
    heights = {block.name: _height(block) for block in flow.blocks} | dict.fromkeys(wires, 0.0)
    members = [
        [block.name for block in flow.blocks if block.column == column]
        + [wire for wire, (at, _) in wires.items() if at == column]
        for column in columns
    ]
    tallest = max(_stack(names, heights) for names in members)
    for column in columns:
        feeding = {name: _fed_from(name, flow, wires, places) for name in members[column]}
        names = sorted(members[column], key=lambda name: (-feeding[name], name))
        y = -0.5 * (tallest - _stack(names, heights))
        for name in names:
            places[name] = _Place(column * (_WIDTH + _GAP), y, heights[name])
            y -= heights[name] + _SPACE
    return places


def _wires(flow: SignalFlow) -> dict[str, tuple[int, Signal]]:
    """Return the wires that pass columns between their blocks: names, the column and one such signal."""
    columns = {block.name: block.column for block in flow.blocks}
    return {
        _wire(signal, column): (column, signal)
        for signal in flow.signals
        for column in range(columns[signal.source] + 1, columns[signal.sink])
    }


def _wire(signal: Signal, column: int) -> str:
    return f"{signal.source}.{signal.output} at {column}"


def _height(block: DiagramBlock) -> float:
    return _TITLE + _ROW * max(len(block.inputs), len(block.outputs)) + 0.1


def _stack(names: list[str], heights: dict[str, float]) -> float:
    return sum(heights[name] + _SPACE for name in names) - _SPACE


def _fed_from(
    name: str, flow: SignalFlow, wires: dict[str, tuple[int, Signal]], places: dict[str, _Place]
) -> float:
    """Return the mean height of the ports and wires already placed that feed a block or a wire [in]."""
    column, signal = wires.get(name, (0, None))
    feeding = [signal] if signal else [s for s in flow.signals if s.sink == name and s.source in places]
    blocks = {block.name: block for block in flow.blocks}
    heights = []
    for s in feeding:
        before = _wire(s, (column or blocks[name].column) - 1)
        port = places[s.source].port(blocks[s.source].outputs.index(s.output))
        heights.append(places[before].y if before in places else port)
    return float(np.mean(heights)) if heights else 0.0


def _extent(places: dict[str, _Place]) -> Point:
    right = max(place.x for place in places.values()) + _WIDTH
    return right, max(-(place.y - place.height) for place in places.values())


def _draw(ax: Axes, flow: SignalFlow, places: dict[str, _Place], width: float, height: float) -> None:
    back = [s for s in flow.signals if places[s.sink].x <= places[s.source].x]
    lanes = sorted({(s.source, s.output) for s in back})
    aside = max(0.6, 0.3 + 0.1 * len(lanes))
    ax.set(xlim=(-aside, width + aside), ylim=(-height - 0.35 - 0.14 * len(lanes), 0.3), aspect="equal")
    ax.axis("off")
    ax.set_title(flow.name, loc="left", fontsize=11, color=INK)
    blocks = {block.name: block for block in flow.blocks}
    sources = list(dict.fromkeys((s.source, s.output) for s in flow.signals))
    for signal in flow.signals:
        start, end = _ends(signal, blocks, places)
        colour = _COLOURS[sources.index((signal.source, signal.output)) % len(_COLOURS)]
        if signal in back:
            lane = lanes.index((signal.source, signal.output))
            path = _round_trip(start, end, -height - 0.3 - 0.14 * lane, 0.2 + 0.1 * lane)
        else:
            path = _curves([start, *_passing(signal, blocks, places), end])
        ax.add_patch(PathPatch(path, facecolor="none", edgecolor=colour, linewidth=1.2, alpha=0.85))
        ax.plot(*end, marker=">", color=colour, markersize=4)
    for block in flow.blocks:
        _draw_block(ax, block, places[block.name])


def _ends(signal: Signal, blocks: dict[str, DiagramBlock], places: dict[str, _Place]) -> tuple[Point, Point]:
    source, sink = places[signal.source], places[signal.sink]
    output = blocks[signal.source].outputs.index(signal.output)
    entry = blocks[signal.sink].inputs.index(signal.input)
    return (source.x + _WIDTH, source.port(output)), (sink.x - 0.03, sink.port(entry))


def _passing(signal: Signal, blocks: dict[str, DiagramBlock], places: dict[str, _Place]) -> list[Point]:
    """Return both ends of the wire in every column that a signal passes [in]."""
    columns = range(blocks[signal.source].column + 1, blocks[signal.sink].column)
    wires = [places[_wire(signal, column)] for column in columns]
    return [(wire.x + along, wire.y) for wire in wires for along in (0.0, _WIDTH)]


def _curves(points: list[Point]) -> Path:
    """Return a smooth curve from point to point, horizontal at each."""
    vertices, codes = [points[0]], [Path.MOVETO]
    for start, end in pairwise(points):
        middle = 0.5 * (start[0] + end[0])
        vertices += [(middle, start[1]), (middle, end[1]), end]
        codes += [Path.CURVE4] * 3
    return Path(vertices, codes)


def _round_trip(start: Point, end: Point, lane: float, out: float) -> Path:
    """Return a path out to the right, down to a lane below all blocks, back to the left and up again."""
    right, left = start[0] + out, end[0] - out
    return Path([start, (right, start[1]), (right, lane), (left, lane), (left, end[1]), end])


def _draw_block(ax: Axes, block: DiagramBlock, place: _Place) -> None:
    outside = block.name in (INPUTS, OUTPUTS)
    ax.add_patch(
        FancyBboxPatch(
            (place.x, place.y - place.height),
            _WIDTH,
            place.height,
            boxstyle="round,pad=0,rounding_size=0.08",
            facecolor=PAPER if outside else BLOCK_OF_DIAGRAM,
            edgecolor=GREY if outside else INK,
            linestyle="dashed" if outside else "solid",
            linewidth=1.0,
            zorder=3,
        )
    )
    middle = place.x + 0.5 * _WIDTH
    ax.text(middle, place.y - 0.15, block.name.replace("_", " "), ha="center", va="center", weight="bold",
            fontsize=8.5, zorder=4)  # fmt: skip
    ax.text(middle, place.y - 0.32, block.kind, ha="center", va="center", fontsize=6.5, color=GREY, zorder=4)
    for row, port in enumerate(block.inputs):
        ax.text(place.x + 0.06, place.port(row), port, ha="left", va="center", fontsize=6.5, zorder=4)
    for row, port in enumerate(block.outputs):
        x = place.x + _WIDTH - 0.06
        ax.text(x, place.port(row), port, ha="right", va="center", fontsize=6.5, zorder=4)
