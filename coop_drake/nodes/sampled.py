"""A Diagram that is evaluated and updated at samples that come from outside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from pydrake.systems.framework import Diagram

from coop_drake.systems.block import release_all
from coop_drake.tree.pose import FloatArray


class SampledDiagram:
    """A Diagram without continuous state, whose inputs and time are set by hand.

    Drake's Simulator does the same at an instant: it computes all discrete updates from the state before,
    and then puts them into effect together.

    Args:
        diagram: All its discrete updates have one period and no offset.
    """

    def __init__(self, diagram: Diagram) -> None:
        self.diagram = diagram
        self.context = diagram.CreateDefaultContext()
        self._inputs: dict[str, FloatArray] = {}

    def at(self, time: float, inputs: Mapping[str, FloatArray]) -> None:
        """Set the time [s] and the inputs; what was computed for the same ones is not computed again."""
        if time != self.context.get_time():
            self.context.SetTime(time)
        for name, value in inputs.items():
            known = self._inputs.get(name)
            if known is None or known.tobytes() != value.tobytes():
                self.diagram.GetInputPort(name).FixValue(self.context, value)
                self._inputs[name] = value.copy()

    def update(self) -> None:
        """Carry out the discrete updates of one sample."""
        self.context.SetDiscreteState(self.diagram.EvalUniquePeriodicDiscreteUpdate(self.context))

    def output(self, name: str) -> FloatArray:
        """Return the present value of an output."""
        return np.array(self.diagram.GetOutputPort(name).Eval(self.context))

    def release(self) -> None:
        """Free all memory; the Diagram may not be used any more."""
        del self.context
        release_all(self.diagram)


def row_of(diagram: SampledDiagram, inner: Diagram, names: Sequence[str]) -> FloatArray:
    """Return the present values of outputs of a Diagram inside a sampled one, one after the other."""
    context = inner.GetMyContextFromRoot(diagram.context)
    return np.concatenate([inner.GetOutputPort(name).Eval(context) for name in names])
