"""Sockets of ZeroMQ as both ends of a channel need them."""

from __future__ import annotations

import math
from typing import Any

import zmq
import zmq.utils.monitor

from coop_drake.messages.codec import LONGEST
from coop_drake.messages.keys import KeyPair

HIGH_WATER = 1000
"""Messages that wait for one connection; at 200 Hz those of five seconds. Further ones are not sent."""

_ALIVE = 500
"""Time between two signs of life of a connection, which ZeroMQ itself exchanges [ms]."""

_DEAD = 2000
"""A connection without them for so long is closed [ms]."""

_FAILURES = (
    zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL
    | zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL
    | zmq.EVENT_HANDSHAKE_FAILED_AUTH
)
FAILURES = frozenset(
    (
        zmq.Event.HANDSHAKE_FAILED_NO_DETAIL,
        zmq.Event.HANDSHAKE_FAILED_PROTOCOL,
        zmq.Event.HANDSHAKE_FAILED_AUTH,
    )
)
"""Events of a connection that does not come about."""


def open_socket(context: zmq.Context[Any], kind: int, keys: KeyPair | None) -> zmq.Socket[bytes]:
    """Open a socket with bounded queues, which never waits when it is closed.

    Args:
        context: Of the process.
        kind: ``zmq.ROUTER`` or ``zmq.DEALER``.
        keys: Its own keys, None for no encryption.
    """
    socket: zmq.Socket[bytes] = context.socket(kind)
    socket.set_hwm(HIGH_WATER)
    for option, value in (
        (zmq.LINGER, 200),
        (zmq.MAXMSGSIZE, LONGEST),
        (zmq.HEARTBEAT_IVL, _ALIVE),
        (zmq.HEARTBEAT_TIMEOUT, _DEAD),
        (zmq.RECONNECT_IVL, 20),
        (zmq.RECONNECT_IVL_MAX, 500),
        (zmq.HANDSHAKE_IVL, 5000),
    ):
        socket.setsockopt(option, value)
    if keys is not None:
        socket.curve_publickey, socket.curve_secretkey = keys.public.encode(), keys.private.encode()
    return socket


def watch_socket(socket: zmq.Socket[bytes], events: int = 0) -> zmq.Socket[bytes]:
    """Return the socket on which the events of a socket's connections arrive, failures among them."""
    return socket.get_monitor_socket(_FAILURES | events)


def next_event(monitor: zmq.Socket[bytes]) -> zmq.Event | None:
    """Return the next event of connections, None where there is none."""
    try:
        return zmq.Event(zmq.utils.monitor.recv_monitor_message(monitor, zmq.NOBLOCK)["event"])
    except zmq.Again:
        return None


def next_parts(socket: zmq.Socket[bytes]) -> list[zmq.Frame] | None:
    """Return the parts of the next message, at most three of them; None where there is no message."""
    try:
        parts = [socket.recv(zmq.NOBLOCK, copy=False)]
    except zmq.Again:
        return None
    while parts[-1].more:
        part = socket.recv(copy=False)
        parts = [*parts, part] if len(parts) < 3 else [*parts[:2], part]
    return parts


def wait_for(sockets: list[zmq.Socket[bytes]], seconds: float) -> None:
    """Wait until something arrives on one of the sockets, at most for a time, and use no processor."""
    poller = zmq.Poller()
    for socket in sockets:
        poller.register(socket, zmq.POLLIN)
    poller.poll(max(0, math.ceil(1e3 * seconds)))
