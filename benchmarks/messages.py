"""What a message between two processes costs: round trips over ZeroMQ beside a pipe, bytes beside pickle."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.connection import Connection
from time import perf_counter, process_time

from benchmarks.rows import Row, best_seconds
from benchmarks.tasks import Task
from coop_drake.apart.messages import (
    SUPERVISOR,
    WORLD,
    Effort,
    Goodbye,
    Sample,
    decode,
    decoder_of,
    encode,
)
from coop_drake.apart.team_files import local_book, make_keys
from coop_drake.apart.transport import Ends, Network
from coop_drake.errors import MessagingError

_TRIPS = 2000
"""Round trips of one figure: a second on a slow machine."""

_LIMIT = 30.0
"""Longest time that an answer may take [s]."""

_CODED = 1000
_REPEATS = 5

_SAMPLE = Sample(1, 0.005, True, False, (0, 0), 0.0, 0.0, (1.0, 2.0, 0.5), tuple(0.1 * i for i in range(10)))
_EFFORT = Effort(1, 0.0, (0, 0), 0, (1.0, 2.0, 3.0, 4.0, 5.0), ())
"""What a robot with two joints is sent at every sample, and what it answers."""


def message_tasks() -> list[Task]:
    """All at once: the figures stand beside each other."""
    return [Task("apart/cost/messages", lambda rows: _rows(), alone=True)]


def _rows() -> list[Row]:
    piped = _piped(_TRIPS)
    rows = []
    for name in ("open", "encrypted"):
        wall, processor = round_trip(_TRIPS, encrypted=name == "encrypted")
        rows += [
            Row(f"apart/cost/messages/{name}/round_trip", 1e6 * wall, "us", "pipe", 1e6 * piped[0]),
            Row(f"apart/cost/messages/{name}/cpu", 1e6 * processor, "us", "pipe", 1e6 * piped[1]),
        ]
    data, decoder = encode(1, 1, _SAMPLE), decoder_of(WORLD, 0)
    pickled = pickle.dumps(_SAMPLE)
    for name, work, peer in (
        ("encode", lambda: encode(1, 1, _SAMPLE), lambda: pickle.dumps(_SAMPLE)),
        ("decode", lambda: decode(data, decoder), lambda: pickle.loads(pickled)),
    ):
        rows.append(Row(f"apart/cost/messages/bytes/{name}", _each(work), "us", "pickle", _each(peer)))
    rows.append(Row("apart/cost/messages/bytes/size", len(data), "bytes", "pickle", len(pickled)))
    return rows


def _each(work: Callable[[], object]) -> float:
    """Time of the processor for one call [us]."""

    def many() -> None:
        for _ in range(_CODED):
            work()

    return 1e6 * best_seconds(many, _REPEATS, clock=process_time) / _CODED


def round_trip(trips: int, *, encrypted: bool) -> tuple[float, float]:
    """Send samples to a robot's process, which answers with efforts.

    Args:
        trips: How many, one after the other.
        encrypted: Whether both have keys.

    Returns:
        Time by the clock on the wall and by this process's processor for one of them [s].

    Raises:
        MessagingError: The other process did not answer in time.
    """
    keys = {index: make_keys() for index in (0, SUPERVISOR, WORLD)} if encrypted else {}
    book = local_book(1, keys)
    world = Ends(Network(book, keys=keys.get(WORLD)), WORLD)
    process = get_context("spawn").Process(
        target=_answer, args=(Network(book, keys=keys.get(0)),), daemon=True
    )
    process.start()

    def heard() -> None:
        if world.receive(_LIMIT) is None:
            raise MessagingError("the process of the benchmark did not answer")

    try:
        heard()  # Its session.
        wall, processor = perf_counter(), process_time()
        for _ in range(trips):
            world.send(0, _SAMPLE)
            heard()
        return (perf_counter() - wall) / trips, (process_time() - processor) / trips
    finally:
        world.send(0, Goodbye(0))
        process.join(_LIMIT)
        world.close()


def _answer(network: Network) -> None:
    robot = Ends(network, 0)
    while (taken := robot.receive(_LIMIT)) is not None and not isinstance(taken[1], Goodbye):
        robot.send(WORLD, _EFFORT)
    robot.close()


def _piped(trips: int) -> tuple[float, float]:
    """The same bytes through a pipe; results as of `round_trip`."""
    here, there = get_context("spawn").Pipe()
    process = get_context("spawn").Process(target=_answer_piped, args=(there,), daemon=True)
    process.start()
    data = encode(1, 1, _SAMPLE)
    here.send_bytes(data)
    here.recv_bytes()
    wall, processor = perf_counter(), process_time()
    for _ in range(trips):
        here.send_bytes(data)
        here.recv_bytes()
    figures = (perf_counter() - wall) / trips, (process_time() - processor) / trips
    here.send_bytes(b"")
    process.join(_LIMIT)
    return figures


def _answer_piped(there: Connection) -> None:
    data = encode(1, 1, _EFFORT)
    while there.recv_bytes():
        there.send_bytes(data)
