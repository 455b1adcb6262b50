"""Builds Drake's Selector, which rearranges elements of vectors, from names and indices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pydrake.systems.primitives import Selector, SelectorParams


def build_selector(inputs: Mapping[str, int], outputs: Mapping[str, Sequence[tuple[int, int]]]) -> Selector:
    """Build a Selector, whose outputs are made of elements of its inputs.

    Args:
        inputs: Names and sizes of the inputs.
        outputs: Names of the outputs, and for each element of an output the input's index and the index in
            it.
    """
    return Selector(
        SelectorParams(
            inputs=[SelectorParams.InputPortParams(name=name, size=size) for name, size in inputs.items()],
            outputs=[
                SelectorParams.OutputPortParams(
                    name=name,
                    selections=[
                        SelectorParams.OutputSelection(input_port_index=port, input_offset=place)
                        for port, place in places
                    ],
                )
                for name, places in outputs.items()
            ],
        )
    )
