"""A process between others: it loses, delays, doubles or reorders messages by their number."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence

import zmq

from coop_drake.messages.codec import HEADER

Rule = Callable[[int, bytes], Sequence[bytes]]
"""What is passed on when a message comes: its number among those of its kind, from 0 on, and its bytes."""


def kind_of(data: bytes) -> int:
    """The kind that a message says it is, -1 where it is too short."""
    return data[3] if len(data) >= HEADER.size else -1


def lose(chosen: Callable[[int], bool]) -> Rule:
    """Lose the messages whose numbers are chosen."""
    return lambda number, data: [] if chosen(number) else [data]


def double(chosen: Callable[[int], bool]) -> Rule:
    """Pass them on twice."""
    return lambda number, data: [data, data] if chosen(number) else [data]


def delay(chosen: Callable[[int], bool], by: int) -> Rule:
    """Pass them on after as many later messages of their kind: late and, with that, reordered."""
    kept: list[tuple[int, bytes]] = []

    def rule(number: int, data: bytes) -> list[bytes]:
        due = [held for at, held in kept if at <= number]
        kept[:] = [(at, held) for at, held in kept if at > number]
        if chosen(number):
            kept.append((number + by, data))
            return due
        return [data, *due]

    return rule


class Meddler:
    """Listens in place of a server and passes on what comes, in a thread of its own.

    Args:
        server: Address of the server.
        rules: What happens to messages by their kind; others are passed on.
        address: Where it listens.

    Attributes:
        address: Where it listens, with its port.
        seen: Number of messages of each kind.
    """

    def __init__(self, server: str, rules: dict[int, Rule], address: str = "tcp://127.0.0.1:*") -> None:
        self._server, self._rules, self.seen = server, rules, dict[int, int]()
        self._context = zmq.Context()
        self._front = self._context.socket(zmq.ROUTER)
        self._front.bind(address)
        self.address = self._front.getsockopt_string(zmq.LAST_ENDPOINT)
        self._stop, stop = self._context.socket(zmq.PAIR), self._context.socket(zmq.PAIR)
        self._stop.bind("inproc://stop")
        stop.connect("inproc://stop")
        self._thread = threading.Thread(target=self._run, args=(stop,), daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop, and close all connections."""
        self._stop.send(b"")
        self._thread.join()
        self._stop.close()
        self._context.term()

    def _run(self, stop: zmq.Socket[bytes]) -> None:
        routes = dict[zmq.Socket[bytes], bytes]()
        try:
            self._pass_on(stop, routes)
        finally:
            for socket in (stop, self._front, *routes):
                socket.close(linger=0)

    def _pass_on(self, stop: zmq.Socket[bytes], routes: dict[zmq.Socket[bytes], bytes]) -> None:
        poller, backs = zmq.Poller(), dict[bytes, zmq.Socket[bytes]]()
        for socket in (stop, self._front):
            poller.register(socket, zmq.POLLIN)
        while True:
            ready = dict(poller.poll())
            if stop in ready:
                return
            if self._front in ready:
                route, data = self._front.recv_multipart()
                if route not in backs:
                    back = backs[route] = self._context.socket(zmq.DEALER)
                    back.connect(self._server)
                    routes[back] = route
                    poller.register(back, zmq.POLLIN)
                for passed in self._passed(data):
                    backs[route].send(passed)
            for back, route in routes.items():
                if back in ready:
                    for passed in self._passed(back.recv()):
                        self._front.send_multipart([route, passed])

    def _passed(self, data: bytes) -> Sequence[bytes]:
        kind = kind_of(data)
        number = self.seen.get(kind, 0)
        self.seen[kind] = number + 1
        return self._rules.get(kind, lose(lambda _: False))(number, data)
