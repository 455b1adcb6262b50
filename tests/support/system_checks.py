"""What every LeafSystem must do: named ports, and outputs that only read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydrake.systems.framework import Context, PortDataType, System

SIZE_OF_ABSTRACT = "abstract"


def port_sizes(system: System) -> tuple[dict[str, object], dict[str, object]]:
    """Names and sizes of the inputs and of the outputs; abstract ports have the size ``abstract``."""

    def sizes(ports: list[Any]) -> dict[str, object]:
        return {
            port.get_name(): port.size()
            if port.get_data_type() == PortDataType.kVectorValued
            else SIZE_OF_ABSTRACT
            for port in ports
        }

    return (
        sizes([system.get_input_port(i) for i in range(system.num_input_ports())]),
        sizes([system.get_output_port(i) for i in range(system.num_output_ports())]),
    )


def context_with(system: System, inputs: Mapping[str, Any], time: float = 0.0) -> Context:
    """A context in which the named inputs are fixed."""
    context = system.CreateDefaultContext()
    context.SetTime(time)
    for name, value in inputs.items():
        system.GetInputPort(name).FixValue(context, value)
    return context


def evaluate(system: System, inputs: Mapping[str, Any], output: str, time: float = 0.0) -> Any:
    """Value of an output for these inputs; the state must be afterwards what it was before."""
    context = context_with(system, inputs, time)
    before = state_of(context)
    value = system.GetOutputPort(output).Eval(context)
    assert state_of(context) == before
    return value


def state_of(context: Context) -> tuple[list[float], list[list[float]]]:
    """Continuous and discrete state as plain numbers."""
    discrete = context.get_discrete_state()
    return (
        list(context.get_continuous_state_vector().CopyToVector()),
        [list(discrete.value(group)) for group in range(discrete.num_groups())],
    )
