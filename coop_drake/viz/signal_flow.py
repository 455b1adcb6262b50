"""The blocks of a Diagram and the signals that join them, as plain data."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import networkx as nx
from pydrake.systems.framework import Diagram, InputPortIndex, OutputPortIndex, System

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
