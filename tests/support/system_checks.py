"""What every LeafSystem must do: named ports, outputs that only read, clear refusal of missing inputs."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
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


def assert_every_input_is_required(
    system: System, inputs: Mapping[str, Any], needed: Mapping[str, set[str]], time: float = 0.0
) -> None:
    """Every output names, when asked without it, each input that it needs; and needs no other."""
    for output, names in needed.items():
        for missing in inputs:
            rest = {name: value for name, value in inputs.items() if name != missing}
            context = context_with(system, rest, time)
            if missing in names:
                with pytest.raises(RuntimeError, match=re.escape(missing)):
                    system.GetOutputPort(output).Eval(context)
            else:
                assert np.all(np.isfinite(system.GetOutputPort(output).Eval(context)))
