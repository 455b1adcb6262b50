"""A drawing of the blocks of a Diagram and of what flows between them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import networkx as nx
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch, PathPatch
from matplotlib.path import Path
from pydrake.systems.framework import Diagram, InputPortIndex, OutputPortIndex, System

from coop_drake.diagram import TELEMETRY, ClosedLoop
from coop_drake.drawing import colours
from coop_drake.drawing.canvas import house_style, new_figure

# The blocks of a Diagram and the signals that join them, as plain data.

INPUTS, OUTPUTS = "from outside", "to outside"
"""Names of the blocks that stand for a Diagram's own ports."""


class DiagramBlock(NamedTuple):
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


class Signal(NamedTuple):
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
    graph: nx.DiGraph[str] = nx.DiGraph()
    for signal in signals:
        graph.add_nodes_from((signal.source, signal.sink))
        system = systems.get(signal.source)
        if system is None or system.HasDirectFeedthrough(_outputs(system).index(signal.output)):
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

_COLOURS = (
    colours.BLUE, colours.VERMILLION, colours.GREEN, colours.PURPLE, colours.ORANGE, colours.SKY,
)  # fmt: skip
Point = tuple[float, float]


def block_diagram_figure(loop: ClosedLoop, robot: int = 0) -> Figure:
    """Draw the whole loop, and below it the controller of one robot.

    Raises:
        IndexError: The team has no such robot.
    """
    if not 0 <= robot < len(loop.bare_controllers):
        raise IndexError(f"robot {robot} is not in the team of {len(loop.bare_controllers)}")
    controller, telemetry = loop.bare_controllers[robot], frozenset(TELEMETRY)
    said = "ready reports" if loop.plan.motion is None else "words"
    drawings = (
        _Drawing(signal_flow(loop.diagram, f"Closed loop: between robots only {said} cross")),
        _Drawing(signal_flow(controller, f"Controller of robot {robot}", telemetry=telemetry)),
    )
    width = max(one.right - one.left for one in drawings)
    height = _CAPTION + sum(_NAME - one.bottom for one in drawings)
    scale = min(1.0, _PAGE[0] / width, _PAGE[1] / height)
    caption = "Blocks as they are wired in Drake, inputs at the left, outputs at the right of each."
    with house_style():
        figure = new_figure(scale * width, scale * height, caption, margins=(0.0, 0.0, 0.0))
        above = height
        for one in drawings:
            above -= _NAME - one.bottom
            place = 0.0, above / height, (one.right - one.left) / width, (_NAME - one.bottom) / height
            ax = figure.add_axes(place, xlim=(one.left, one.right), ylim=(one.bottom, _NAME))
            one.draw(ax, scale)
    return figure


class _Drawing:
    """Where the blocks of a Diagram are drawn, and the wires of signals that pass columns between them.

    Attributes:
        left: Left end of all that is drawn [in].
        right: Right end [in].
        bottom: Lower end [in]; the upper one is that of the Diagram's name.
    """

    def __init__(self, flow: SignalFlow) -> None:
        self._flow, self._blocks = flow, {block.name: block for block in flow.blocks}
        self._wires = {
            _wire(signal, column): (column, signal)
            for signal in flow.signals
            for column in range(self._blocks[signal.source].column + 1, self._blocks[signal.sink].column)
        }
        self._heights = dict.fromkeys(self._wires, 0.0) | {
            block.name: _TITLE + _ROW * max(len(block.inputs) + len(block.outputs), 1) + 0.1
            for block in flow.blocks
        }
        self._places: dict[str, Point] = {}  # Left edges and tops, also of wires.
        self._place()
        sources = ((s.source, s.output) for s in flow.signals if self._goes_back(s))
        self._lanes = sorted(set(sources))  # Of signals that go back to the left, below all blocks.
        aside = 0.2 + 0.1 * len(self._lanes)
        self._lowest = min(y - self._heights[name] for name, (_, y) in self._places.items())
        self.left, self.right = -aside, max(x for x, _ in self._places.values()) + _WIDTH + aside
        self.bottom = self._lowest - 0.35 - 0.14 * len(self._lanes)

    def _place(self) -> None:
        """Place blocks, and wires, in columns; in each, in the order of what feeds them."""
        columns = [
            [block.name for block in self._flow.blocks if block.column == column]
            + [wire for wire, (at, _) in self._wires.items() if at == column]
            for column in range(1 + max(block.column for block in self._flow.blocks))
        ]
        stacks = [sum(self._heights[name] + _SPACE for name in names) - _SPACE for names in columns]
        for column, names in enumerate(columns):
            feeding = {name: self._fed_from(name) for name in names}
            y = -0.5 * (max(stacks) - stacks[column])
            for name in sorted(names, key=lambda name: (-feeding[name], name)):
                self._places[name] = column * (_WIDTH + _GAP), y
                y -= self._heights[name] + _SPACE

    def _fed_from(self, name: str) -> float:
        """Return the mean height of the ports and wires already placed that feed a block or a wire [in]."""
        signals = [s for s in self._flow.signals if s.sink == name and s.source in self._places]
        if name in self._wires:
            column, signal = self._wires[name]
            signals = [signal]
        else:
            column = self._blocks[name].column
        before = [self._places.get(_wire(s, column - 1)) or self._start(s) for s in signals]
        return float(np.mean([y for _, y in before])) if before else 0.0

    def _port(self, name: str, row: int) -> float:
        """Return the height of the middle of a port's row, inputs first, outputs below them [in]."""
        return self._places[name][1] - _TITLE - _ROW * (row + 0.5)

    def _start(self, signal: Signal) -> Point:
        block = self._blocks[signal.source]
        row = len(block.inputs) + block.outputs.index(signal.output)
        return self._places[block.name][0] + _WIDTH, self._port(block.name, row)

    def _end(self, signal: Signal) -> Point:
        block = self._blocks[signal.sink]
        row = block.inputs.index(signal.input)
        return self._places[block.name][0] - 0.03, self._port(block.name, row)

    def _goes_back(self, signal: Signal) -> bool:
        return self._places[signal.sink][0] <= self._places[signal.source][0]

    def draw(self, ax: Axes, scale: float) -> None:
        """Draw the Diagram, all texts and marks scaled."""
        ax.axis("off")
        ax.text(0.0, _NAME - 0.2, self._flow.name, fontsize=11 * scale, color=colours.INK)
        sources = list(dict.fromkeys((s.source, s.output) for s in self._flow.signals))
        for signal in self._flow.signals:
            colour = _COLOURS[sources.index((signal.source, signal.output)) % len(_COLOURS)]
            path, end = self._path(signal), self._end(signal)
            ax.add_patch(PathPatch(path, facecolor="none", edgecolor=colour, linewidth=1.2, alpha=0.85))
            ax.plot(*end, marker=">", color=colour, markersize=4 * scale)
        for block in self._flow.blocks:
            self._draw_block(ax, block, scale)

    def _path(self, signal: Signal) -> Path:
        """Return a curve through the wires, or a way out, down to a lane, back to the left and up again."""
        start, end = self._start(signal), self._end(signal)
        if self._goes_back(signal):
            lane = self._lanes.index((signal.source, signal.output))
            y, out = self._lowest - 0.3 - 0.14 * lane, 0.15 + 0.1 * lane
            right, left = start[0] + out, end[0] - out
            return Path([start, (right, start[1]), (right, y), (left, y), (left, end[1]), end])
        columns = range(self._blocks[signal.source].column + 1, self._blocks[signal.sink].column)
        wires = [self._places[_wire(signal, column)] for column in columns]
        points = [start, *((x + along, y) for x, y in wires for along in (0.0, _WIDTH)), end]
        vertices, codes = [start], [Path.MOVETO]
        for one, other in pairwise(points):  # Horizontal at each.
            middle = 0.5 * (one[0] + other[0])
            vertices += [(middle, one[1]), (middle, other[1]), other]
            codes += [Path.CURVE4] * 3
        return Path(vertices, codes)

    def _draw_block(self, ax: Axes, block: DiagramBlock, scale: float) -> None:
        (x, y), height = self._places[block.name], self._heights[block.name]
        outside = block.name in (INPUTS, OUTPUTS)
        ax.add_patch(
            FancyBboxPatch(
                (x, y - height),
                _WIDTH,
                height,
                boxstyle="round,pad=0,rounding_size=0.08",
                facecolor=colours.PAPER if outside else colours.BLOCK_OF_DIAGRAM,
                edgecolor=colours.GREY if outside else colours.INK,
                linestyle="dashed" if outside else "solid",
                linewidth=1.0,
                zorder=3,
            )
        )
        middle, common = x + 0.5 * _WIDTH, dict[str, Any](va="center", zorder=4)
        name, small = block.name.replace("_", " "), 6.5 * scale
        ax.text(middle, y - 0.15, name, ha="center", weight="bold", fontsize=7.0 * scale, **common)
        ax.text(middle, y - 0.32, block.kind, ha="center", fontsize=small, color=colours.GREY, **common)
        for row, port in enumerate((*block.inputs, *block.outputs)):
            entry = row < len(block.inputs)
            at, aligned = (x + 0.06, "left") if entry else (x + _WIDTH - 0.06, "right")
            ax.text(at, self._port(block.name, row), port, ha=aligned, fontsize=small, **common)


def _wire(signal: Signal, column: int) -> str:
    return f"{signal.source}.{signal.output} at {column}"
