"""Questions to processes, whether answers fit them, and what a run reports about each process."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from coop_drake.messages import SUPERVISOR, Effort, Sample, Status, Telemetry, Tick, name_of
from coop_drake.nodes.states import STATES
from coop_drake.tree.pose import FloatArray


def question(
    index: int,
    sample: int,
    time: float,
    measured: Sequence[FloatArray],
    counts: Mapping[int, Any],
    stamps: Sequence[FloatArray],
    *,
    step: bool,
    stopped: bool,
) -> Sample | Tick:
    """Return what a process is asked at an instant.

    Args:
        index: Its index in messages.
        sample: Number of the sample.
        time: What its clock shows [s].
        measured: What every robot measures: its own state, then the object's pose.
        counts: How many messages each process has sent to the team, or the supervisor to each robot.
        stamps: When every robot's pose and state were measured [s].
        step: Whether it updates its state.
        stopped: Whether the drives brake.
    """
    if index == SUPERVISOR:
        sent = tuple(counts.get(k, 0) for k in range(len(measured)))
        return Tick(sample, time, step, stopped, sent)
    told, own = counts.get(SUPERVISOR), measured[index]
    heard, (pose, state) = told[index] if told else 0, map(float, stamps[index])
    return Sample(sample, time, step, stopped, heard, pose, state, tuple(own[-3:]), tuple(own[:-3]))


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
        size = sizes[sender]
        fitting = len(message.efforts) == size and len(message.rest) in (0, size)
        return fitting and bool(message.state < len(STATES))
    before = known.get((sender, Telemetry))
    return (before is None or len(before.values) == len(message.values)) and bool(message.state < len(STATES))


def process_facts(
    index: int,
    shown: Telemetry | Status | None,
    *,
    missing_since: float | None,
    ended: bool,
    state: int,
    age: float | None,
) -> dict[str, Any]:
    """Return what a run reports about a process.

    Args:
        index: Its index in messages.
        shown: What it has shown last.
        missing_since: Since which simulated time it is missing [s].
        ended: Whether a process that is missing is known to have ended.
        state: The last state of a robot.
        age: Age of what its last command was computed from, when it came to the world [s].
    """
    there, missing = "there" if index == SUPERVISOR else STATES[state], "gone" if ended else "silent"
    return {
        "name": name_of(index),
        "state": there if missing_since is None else missing,
        "missing_since": missing_since,
        "team_messages": 0 if shown is None else int(np.sum(shown.team_messages)),
        "refused": 0 if shown is None else shown.refused,
        "age": age,
    }
