"""Base class of all LeafSystems of this package; it lets their memory be freed."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from pydrake.systems.framework import Diagram, LeafSystem


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

    def DeclareAbstractOutputPort(
        self, name: str, alloc: Callable[[], Any], calc: Callable[..., None], *rest: Any
    ) -> Any:
        """As Drake's; the port does not keep the block alive once it is released."""
        return super().DeclareAbstractOutputPort(name, self._loosely(alloc), self._loosely(calc), *rest)

    def DeclarePerStepDiscreteUpdateEvent(self, update: Callable[..., Any]) -> None:
        """As Drake's; the event does not keep the block alive once it is released."""
        super().DeclarePerStepDiscreteUpdateEvent(self._loosely(update))

    def DeclarePeriodicDiscreteUpdateEvent(
        self, period_sec: float, offset_sec: float, update: Callable[..., Any]
    ) -> None:
        """As Drake's; the event does not keep the block alive once it is released."""
        super().DeclarePeriodicDiscreteUpdateEvent(period_sec, offset_sec, self._loosely(update))

    def declare_update(self, update: Callable[..., Any], period: float | None, offset: float = 0.0) -> None:
        """Declare a discrete update in every step, or every ``period`` from ``offset`` on [s]."""
        if period is None:
            self.DeclarePerStepDiscreteUpdateEvent(update)
        else:
            self.DeclarePeriodicDiscreteUpdateEvent(period_sec=period, offset_sec=offset, update=update)

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


def release_all(diagram: Diagram) -> None:
    """Release every block of a Diagram, also in the Diagrams inside."""
    for system in diagram.GetSystems():
        if isinstance(system, Block):
            system.release()
        elif isinstance(system, Diagram):
            release_all(system)


def _nothing(*_: object) -> None:
    """Do nothing: what a callback does after its release."""
