"""What all LeafSystems of this package have in common: they can be let go of."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from pydrake.systems.framework import LeafSystem

__all__ = ["Block"]


class Block(LeafSystem):
    """A LeafSystem that does not stay in memory for ever.

    Drake's ports keep their system alive, and the system its ports' callbacks, across languages, where
    Python's collector cannot see it: a block that keeps handles of its ports is never freed, nor is the
    Diagram that it is part of, nor its plant. ``release`` cuts what it keeps.
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

    def release(self) -> None:
        """Forget everything; neither the block nor its Diagram may be used any more."""
        for callback in self._callbacks:
            callback.__setstate__((_nothing, (), {}, {}))  # type: ignore[attr-defined]
        self.__dict__.clear()

    def _loosely(self, method: Callable[..., Any]) -> Callable[..., Any]:
        """The same method, as a callback that can be emptied."""
        callback = partial(method)
        self._callbacks.append(callback)
        return callback


def _nothing(*_: object) -> None:
    """What is left of a callback."""
