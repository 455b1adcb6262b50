"""A drawing of the blocks of a Diagram and of what flows between them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import networkx as nx
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch, PathPatch
from matplotlib.path import Path
from pydrake.systems.framework import Diagram, InputPortIndex, OutputPortIndex, System

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

# The blocks of a Diagram and the signals that join them, as plain data.

INPUTS, OUTPUTS = "from outside", "to outside"
"""Names of the blocks that stand for a Diagram's own ports."""


@dataclass(frozen=True)
class DiagramBlock:
    """One block.

    Attributes:
        name: Its name in the Diagram.
        kind: Its class; empty for Diagrams, and for the Diagram's own inputs and outputs.
        inputs: Names of the connected input ports, in the ports' order.
        outputs: Names of the connected output ports, in the ports' order.
        column: Its place from left to right.
    """

    name: str
    kind: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    column: int


@dataclass(frozen=True)
class Signal:
    """One connection, from an output port of a block to an input port of another."""

    source: str
    output: str
    sink: str
    input: str


@dataclass(frozen=True)
class SignalFlow:
    """The content of a Diagram.

    Attributes:
        name: The Diagram's name in the picture.
        blocks: Its blocks.
        signals: Its connections, in the order of the blocks and ports that they join.
    """

    name: str
    blocks: tuple[DiagramBlock, ...]
    signals: tuple[Signal, ...]


def signal_flow(diagram: Diagram, name: str, *, telemetry: frozenset[str] = frozenset()) -> SignalFlow:
    """Read the blocks and the connections of a Diagram, in an order that only depends on how it was built.

    The inside of the blocks is not read. Outputs of the Diagram that only logs read, its ``telemetry``, are
    left out.
    """
    systems = {system.get_name(): system for system in diagram.GetSystems()}
    outputs = [(INPUTS, port) for port in _inputs(diagram)]
    outputs += [(block, port) for block, system in systems.items() for port in _outputs(system)]
    inputs = [(block, port) for block, system in systems.items() for port in _inputs(system)]
    inputs += [(OUTPUTS, port) for port in _outputs(diagram)]
    # Drake lists connections in an order that changes from run to run.
    signals = sorted(
        (signal for signal in _signals(diagram) if signal.input not in telemetry or signal.sink != OUTPUTS),
        key=lambda s: (outputs.index((s.source, s.output)), inputs.index((s.sink, s.input))),
    )
    ends = {(signal.sink, signal.input) for signal in signals}
    blocks = (
        DiagramBlock(
            block,
            _kind(systems.get(block)),
            tuple(port for owner, port in inputs if owner == block and (block, port) in ends),
            tuple(dict.fromkeys(s.output for s in signals if s.source == block)),
            column,
        )
        for block, column in _columns(signals, systems)
    )
    return SignalFlow(name, tuple(blocks), tuple(signals))


def _inputs(system: System) -> list[str]:
    return [system.get_input_port(k).get_name() for k in range(system.num_input_ports())]


def _outputs(system: System) -> list[str]:
    return [system.get_output_port(k).get_name() for k in range(system.num_output_ports())]


def _signals(diagram: Diagram) -> Iterator[Signal]:
    """Yield all connections inside a Diagram, and those with its own ports."""
    for (sink, entry), (source, output) in diagram.connection_map().items():
        yield Signal(source.get_name(), _outputs(source)[output], sink.get_name(), _inputs(sink)[entry])
    for k, port in enumerate(_inputs(diagram)):
        for sink, entry in diagram.GetInputPortLocators(InputPortIndex(k)):
            yield Signal(INPUTS, port, sink.get_name(), _inputs(sink)[entry])
    for k, port in enumerate(_outputs(diagram)):
        source, output = diagram.get_output_port_locator(OutputPortIndex(k))
        yield Signal(source.get_name(), _outputs(source)[output], OUTPUTS, port)


def _kind(system: System | None) -> str:
    return "" if system is None or isinstance(system, Diagram) else type(system).__name__.rstrip("_")


def _columns(signals: list[Signal], systems: dict[str, System]) -> list[tuple[str, int]]:
    """Return the blocks with their columns: the longest distances from the sources.

    A signal that its block computes from a state alone does not count: it closes a loop.
    """
    held = {
        (block, port)
        for block, system in systems.items()
        for k, port in enumerate(_outputs(system))
        if not system.HasDirectFeedthrough(k)
    }
    graph: nx.DiGraph[str] = nx.DiGraph()
    for signal in signals:
        graph.add_nodes_from((signal.source, signal.sink))
        if (signal.source, signal.output) not in held:
            graph.add_edge(signal.source, signal.sink)
    generations = enumerate(nx.topological_generations(graph))
    return [(block, column) for column, members in generations for block in sorted(members)]


# Draws the closed loop and one robot's controller as block diagrams, port to port.

_ROW, _TITLE, _WIDTH, _GAP, _SPACE = 0.16, 0.42, 1.22, 0.36, 0.25
"""Heights of a port and of a title, width of a block, gaps between columns and between blocks [in]."""

_NAME, _CAPTION = 0.5, 0.4
"""Heights of a Diagram's name with the space below it, and of the caption [in]."""

_PAGE = (11.0, 7.6)
"""Width and height of what fits on a page of A4 or letter paper, turned sideways [in]."""

_COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY)
Point = tuple[float, float]


@dataclass(frozen=True)
class _Place:
    """Where a block is drawn: its left edge, its top and its height [in]."""

    x: float
    y: float
    height: float

    def port(self, row: int) -> float:
        """Return the height of the middle of a port's row, inputs first, outputs below them [in]."""
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
    extents = [_extent(flow, found) for flow, found in zip(flows, places, strict=True)]
    width = max(right - left for left, right, _, _ in extents)
    height = _CAPTION + sum(top - bottom for _, _, bottom, top in extents)
    scale = min(1.0, _PAGE[0] / width, _PAGE[1] / height)
    caption = "Blocks as they are wired in Drake, inputs at the left, outputs at the right of each."
    with house_style():
        figure = new_figure(scale * width, scale * height, caption, margins=(0.0, 0.0, 0.0))
        above = height
        for flow, found, (left, right, bottom, top) in zip(flows, places, extents, strict=True):
            above -= top - bottom
            rectangle = (0.0, above / height, (right - left) / width, (top - bottom) / height)
            ax = figure.add_axes(rectangle, xlim=(left, right), ylim=(bottom, top))
            _draw(ax, flow, found, scale)
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
    return _TITLE + _ROW * max(len(block.inputs) + len(block.outputs), 1) + 0.1


def _output_row(block: DiagramBlock, port: str) -> int:
    return len(block.inputs) + block.outputs.index(port)


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
        port = places[s.source].port(_output_row(blocks[s.source], s.output))
        heights.append(places[before].y if before in places else port)
    return float(np.mean(heights)) if heights else 0.0


def _extent(flow: SignalFlow, places: dict[str, _Place]) -> tuple[float, float, float, float]:
    """Return left, right, lower and upper end of all that is drawn of a Diagram, its name above it [in]."""
    lanes = len(_lanes(flow, places))
    aside = 0.2 + 0.1 * lanes
    right = max(place.x for place in places.values()) + _WIDTH
    bottom = min(place.y - place.height for place in places.values())
    return -aside, right + aside, bottom - 0.35 - 0.14 * lanes, _NAME


def _lanes(flow: SignalFlow, places: dict[str, _Place]) -> list[tuple[str, str]]:
    """Return the sources and outputs of all signals that go back to the left."""
    return sorted({(s.source, s.output) for s in flow.signals if _goes_back(s, places)})


def _goes_back(signal: Signal, places: dict[str, _Place]) -> bool:
    return places[signal.sink].x <= places[signal.source].x


def _draw(ax: Axes, flow: SignalFlow, places: dict[str, _Place], scale: float) -> None:
    """Draw a Diagram, all texts and marks scaled."""
    lanes, lowest = _lanes(flow, places), min(place.y - place.height for place in places.values())
    ax.axis("off")
    ax.text(0.0, _NAME - 0.2, flow.name, fontsize=11 * scale, color=INK)
    blocks = {block.name: block for block in flow.blocks}
    sources = list(dict.fromkeys((s.source, s.output) for s in flow.signals))
    for signal in flow.signals:
        start, end = _ends(signal, blocks, places)
        colour = _COLOURS[sources.index((signal.source, signal.output)) % len(_COLOURS)]
        if _goes_back(signal, places):
            lane = lanes.index((signal.source, signal.output))
            path = _round_trip(start, end, lowest - 0.3 - 0.14 * lane, 0.15 + 0.1 * lane)
        else:
            path = _curves([start, *_passing(signal, blocks, places), end])
        ax.add_patch(PathPatch(path, facecolor="none", edgecolor=colour, linewidth=1.2, alpha=0.85))
        ax.plot(*end, marker=">", color=colour, markersize=4 * scale)
    for block in flow.blocks:
        _draw_block(ax, block, places[block.name], scale)


def _ends(signal: Signal, blocks: dict[str, DiagramBlock], places: dict[str, _Place]) -> tuple[Point, Point]:
    source, sink = places[signal.source], places[signal.sink]
    output = _output_row(blocks[signal.source], signal.output)
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


def _draw_block(ax: Axes, block: DiagramBlock, place: _Place, scale: float) -> None:
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
            fontsize=7.0 * scale, zorder=4)  # fmt: skip
    small = 6.5 * scale
    ax.text(
        middle, place.y - 0.32, block.kind, ha="center", va="center", fontsize=small, color=GREY, zorder=4
    )
    for row, port in enumerate(block.inputs):
        ax.text(place.x + 0.06, place.port(row), port, ha="left", va="center", fontsize=small, zorder=4)
    for port in block.outputs:
        x, row = place.x + _WIDTH - 0.06, _output_row(block, port)
        ax.text(x, place.port(row), port, ha="right", va="center", fontsize=small, zorder=4)
