"""What all blocks have in common: their base classes, and the signals that flow between them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from pydrake.systems.framework import BasicVector, Context, Diagram, InputPort, LeafSystem
from pydrake.systems.primitives import Selector, SelectorParams

from coop_drake.tree.arrays import FloatArray

CURRENT_CELL_SIZE = 2
"""Size of the message of the current cell: its index [-] and the time of its entry [s]."""

READY_SIZE = 2
"""Size of a ready report: the index of the cell that it is about and the margin [-]."""

REQUEST_SIZE = 2
"""Size of a request: 1 to be held, 2 where the drives shall brake, else 0 [-], and the number of the message
[-], new for a new one."""

CLOCK_SIZE = 3
"""Size of a clock's output: lag [s], pace [-] and its derivative [1/s]."""

PHASE_SIZE = 3
"""Size of a phase on a motion: phase [s], pace [-] and its rate [1/s]."""

ALARM_SIZE = 3
"""Size of what a monitor says: 0 while it is quiet, 1 where it asks for a hold, 2 where the drives shall
brake; the largest departure over its level; and the number of this level [-]."""


def robot_record(
    joints: int, *, holds: bool, monitored: bool = False, passes: bool = False
) -> dict[str, int]:
    """Return the names and sizes of the outputs of a robot with n joints that are logged."""
    record = {
        "governor_position": 2,
        "energy_margin": 1,
        "funnels": 2 * (1 + joints),
        "object_acceleration": 3,
        "hand_command": 6,
        "ready": READY_SIZE,
        "clock": CLOCK_SIZE if holds else 0,
        "alarm": ALARM_SIZE if monitored else 0,
    }
    return record | ({"current_cell": CURRENT_CELL_SIZE, "phase": PHASE_SIZE} if passes else {})


def supervisor_record(robots: int, *, holds: bool, passes: bool = False) -> dict[str, int]:
    """Return the names and sizes of the outputs of the supervisor of N robots that are logged."""
    cell = 0 if passes else CURRENT_CELL_SIZE
    return {"current_cell": cell, "arrived": 1, "causes": 1 + robots if holds else 0}


_ON_TIME = np.array([0.0, 1.0, 0.0])


def index_of(current_cell: FloatArray, cells: int) -> int:
    """Return the index of the current cell.

    Args:
        current_cell: Value of a ``current_cell`` port, shape (2,).
        cells: Number of cells of the plan.

    Raises:
        IndexError: The plan has no cell of this index.
    """
    index = int(current_cell[0])
    if 0 <= index < cells:
        return index
    raise IndexError(f"current_cell is {index}; the plan has cells 0 to {cells - 1}")


def clock_of(port: InputPort | None, context: Context) -> FloatArray:
    """Return the value of a ``clock`` port, or (0, 1, 0) where a block has none."""
    return _ON_TIME if port is None else port.Eval(context)


class Block(LeafSystem):
    """A LeafSystem whose memory can be freed.

    Drake's ports keep their system alive, and the system keeps the callbacks of its ports alive. Python's
    garbage collector cannot see this cycle, because half of it is in C++. Without ``release``, neither the
    block nor the Diagram that it is part of, nor the plant, would ever be freed.
    """

    def __init__(self) -> None:
        super().__init__()
        self._callbacks: list[partial[Any]] = []

    def DeclareVectorOutputPort(self, name: str, model: Any, calc: Callable[..., None], *rest: Any) -> Any:
        """As Drake's; the port does not keep the block alive once it is released."""
        return super().DeclareVectorOutputPort(name, model, self._loosely(calc), *rest)

    def declare_update(self, update: Callable[..., Any], period: float | None, offset: float = 0.0) -> None:
        """Declare a discrete update in every step, or every ``period`` from ``offset`` on [s]."""
        if period is None:
            self.DeclarePerStepDiscreteUpdateEvent(self._loosely(update))
        else:
            self.DeclarePeriodicDiscreteUpdateEvent(period, offset, self._loosely(update))

    def declare_kept(self, name: str, size: int, first: int = 0) -> None:
        """Declare an output that shows so many numbers of the discrete state, from ``first`` on."""
        part = slice(first, first + size)

        def write(context: Context, output: BasicVector) -> None:
            output.SetFromVector(self.kept(context)[part])

        self.DeclareVectorOutputPort(name, size, write, {self.xd_ticket()})

    def kept(self, context: Context) -> FloatArray:
        """Return the discrete state of a block that has one group of it."""
        state: FloatArray = context.get_discrete_state_vector().value()
        return state

    def release(self) -> None:
        """Drop all references; neither the block nor its Diagram may be used any more."""
        for callback in self._callbacks:
            callback.__setstate__((_nothing, (), {}, {}))  # type: ignore[attr-defined]
        self.__dict__.clear()

    def _loosely(self, method: Callable[..., Any]) -> Callable[..., Any]:
        """Return the method as a callback that ``release`` can empty."""
        callback = partial(method)
        self._callbacks.append(callback)
        return callback


class Law(Block):
    """A block without state, whose outputs are laws of its inputs.

    Args:
        inputs: Names and sizes of the inputs.
        outputs: Names and sizes of the outputs, each with its law. It is called with the time [s] where
            ``timed``, then with the values of all inputs, then with the vector that it writes.
        timed: Whether the laws depend on the time.
    """

    def __init__(
        self,
        inputs: Mapping[str, int],
        outputs: Mapping[str, tuple[int, Callable[..., object]]],
        *,
        timed: bool = False,
    ) -> None:
        super().__init__()
        ports = [self.DeclareVectorInputPort(name, size) for name, size in inputs.items()]
        for name, (size, law) in outputs.items():
            self.DeclareVectorOutputPort(name, size, partial(_write, ports, law, timed))


def _write(
    ports: Sequence[InputPort], law: Callable[..., object], timed: bool, context: Context, output: BasicVector
) -> None:
    """Write an output of a ``Law``."""
    time = (context.get_time(),) if timed else ()
    law(*time, *[port.Eval(context) for port in ports], output.get_mutable_value())


def release_all(diagram: Diagram) -> None:
    """Release every block of a Diagram, also in the Diagrams inside."""
    for system in diagram.GetSystems():
        if isinstance(system, Block):
            system.release()
        elif isinstance(system, Diagram):
            release_all(system)


def _nothing(*_: object) -> None:
    """Do nothing: what a callback does after its release."""


def build_selector(inputs: Mapping[str, int], outputs: Mapping[str, Sequence[tuple[int, int]]]) -> Selector:
    """Build Drake's Selector, whose outputs are made of elements of its inputs.

    Args:
        inputs: Names and sizes of the inputs.
        outputs: Names of the outputs, and for each element of an output the input's index and the index in
            it.
    """
    parts = SelectorParams()
    parts.inputs = [SelectorParams.InputPortParams(name=name, size=size) for name, size in inputs.items()]
    parts.outputs = [
        SelectorParams.OutputPortParams(
            name=name,
            selections=[
                SelectorParams.OutputSelection(input_port_index=i, input_offset=at) for i, at in places
            ],
        )
        for name, places in outputs.items()
    ]
    return Selector(parts)
