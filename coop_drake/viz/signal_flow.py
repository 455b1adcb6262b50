"""The blocks of a Diagram and the signals that join them, as plain data."""

from __future__ import annotations

from dataclasses import dataclass

import networkx as nx
from pydrake.systems.framework import Diagram, InputPortIndex, OutputPortIndex, System

__all__ = ["Block", "Signal", "SignalFlow", "signal_flow"]


@dataclass(frozen=True)
class Block:
    """One block.

    Attributes:
        name: As the Diagram calls it.
        kind: The class behind it; empty for the Diagram's own inputs and outputs.
        inputs: Names of the connected input ports, in the ports' order.
        outputs: Names of the connected output ports, in the ports' order.
        column: Place in the flow from left to right.
    """

    name: str
    kind: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    column: int


@dataclass(frozen=True)
class Signal:
    """One connection.

    Attributes:
        source: Block that it comes from.
        output: That block's port.
        sink: Block that it goes to.
        input: That block's port.
    """

    source: str
    output: str
    sink: str
    input: str


@dataclass(frozen=True)
class SignalFlow:
    """A Diagram's content.

    Attributes:
        name: The Diagram's.
        blocks: Its blocks.
        signals: Its connections, in the order of the blocks and ports that they come from and go to.
    """

    name: str
    blocks: tuple[Block, ...]
    signals: tuple[Signal, ...]


INPUTS, OUTPUTS = "from outside", "to outside"
"""Names of the blocks that stand for a Diagram's own ports."""


def signal_flow(diagram: Diagram, name: str, *, telemetry: frozenset[str] = frozenset()) -> SignalFlow:
    """Read the blocks and the connections of a Diagram, in an order that only depends on how it was built.

    Args:
        diagram: The Diagram; the inside of its blocks is not read.
        name: Its name in the picture.
        telemetry: Outputs that only logs read; they are left out.
    """
    signals = [
        Signal(
            source.get_name(),
            source.get_output_port(output).get_name(),
            sink.get_name(),
            sink.get_input_port(entry).get_name(),
        )
        for (sink, entry), (source, output) in diagram.connection_map().items()
    ]
    signals += _from_outside(diagram) + _to_outside(diagram, telemetry)
    sources, sinks = _port_orders(diagram)
    signals.sort(key=lambda s: (sources[s.source, s.output], sinks[s.sink, s.input]))
    kinds = {system.get_name(): _kind(system) for system in diagram.GetSystems()}
    held = {
        (system.get_name(), system.get_output_port(output).get_name())
        for system in diagram.GetSystems()
        for output in range(system.num_output_ports())
        if not system.HasDirectFeedthrough(output)
    }
    columns = _columns(signals, held)
    blocks = tuple(
        Block(
            block,
            kinds.get(block, ""),
            tuple(sorted({s.input for s in signals if s.sink == block}, key=lambda name: sinks[block, name])),
            tuple(dict.fromkeys(s.output for s in signals if s.source == block)),
            columns[block],
        )
        for block in sorted(columns, key=lambda block: (columns[block], block))
    )
    return SignalFlow(name, blocks, tuple(signals))


def _port_orders(diagram: Diagram) -> tuple[dict[tuple[str, str], int], dict[tuple[str, str], int]]:
    """Return the ranks of all (block, port) that signals come from, and go to; Drake's order changes."""
    outputs = [(INPUTS, diagram.get_input_port(k).get_name()) for k in range(diagram.num_input_ports())]
    inputs = [(OUTPUTS, diagram.get_output_port(k).get_name()) for k in range(diagram.num_output_ports())]
    for system in diagram.GetSystems():
        name = system.get_name()
        outputs += [(name, system.get_output_port(k).get_name()) for k in range(system.num_output_ports())]
        inputs += [(name, system.get_input_port(k).get_name()) for k in range(system.num_input_ports())]
    return {port: k for k, port in enumerate(outputs)}, {port: k for k, port in enumerate(inputs)}


def _from_outside(diagram: Diagram) -> list[Signal]:
    return [
        Signal(INPUTS, port.get_name(), system.get_name(), system.get_input_port(entry).get_name())
        for port in map(diagram.get_input_port, range(diagram.num_input_ports()))
        for system, entry in diagram.GetInputPortLocators(InputPortIndex(int(port.get_index())))
    ]


def _to_outside(diagram: Diagram, telemetry: frozenset[str]) -> list[Signal]:
    signals = []
    for port in map(diagram.get_output_port, range(diagram.num_output_ports())):
        if port.get_name() not in telemetry:
            system, output = diagram.get_output_port_locator(OutputPortIndex(int(port.get_index())))
            inside = system.get_output_port(output).get_name()
            signals.append(Signal(system.get_name(), inside, OUTPUTS, port.get_name()))
    return signals


def _kind(system: System) -> str:
    return "" if isinstance(system, Diagram) else type(system).__name__.rstrip("_")


def _columns(signals: list[Signal], held: set[tuple[str, str]]) -> dict[str, int]:
    """Return the longest distances of blocks from the sources, not counting signals from a state."""
    graph: nx.DiGraph[str] = nx.DiGraph()
    for signal in signals:
        graph.add_nodes_from((signal.source, signal.sink))
        if (signal.source, signal.output) not in held:
            graph.add_edge(signal.source, signal.sink)
    columns: dict[str, int] = {}
    for column, generation in enumerate(nx.topological_generations(graph)):
        columns.update(dict.fromkeys(generation, column))
    return columns
