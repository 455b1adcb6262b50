"""Whether an answer of a process, which is well formed, fits the question."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from coop_drake.messages import Effort, Status, Telemetry
from coop_drake.nodes.states import STATES


def fits(sender: int, message: Any, sizes: Sequence[int], known: Mapping[tuple[int, type], Any]) -> bool:
    """Whether the lists of an answer are as long as they must be, and its state is one.

    Args:
        sender: Who answers.
        message: An ``Effort``, ``Telemetry`` or ``Status``.
        sizes: Number of efforts of every robot.
        known: The last answers.
    """
    if isinstance(message, Status):
        return len(message.team_messages) == len(sizes) and len(message.causes) in (0, 1 + len(sizes))
    if isinstance(message, Effort):
        return len(message.efforts) == sizes[sender] and bool(message.state < len(STATES))
    before = known.get((sender, Telemetry))
    return (before is None or len(before.values) == len(message.values)) and bool(message.state < len(STATES))
