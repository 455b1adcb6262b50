"""What the server of a channel keeps about each process that it listens to."""

from __future__ import annotations

import math
import secrets
from dataclasses import dataclass, field

from coop_drake.messages.incoming import RATE, Incoming
from coop_drake.messages.outgoing import Outgoing

SILENCE = 0.5
"""A name is free for another process when the one that has it has not been heard for so long [s]."""

_SESSIONS = range(1, 256)
"""Numbers of sessions: one byte in every header; 0 is no session."""

_MOST_OFFERS = 8
"""Sessions that may be offered under one name at a time; the oldest offer lapses."""


@dataclass
class Peer:
    """One process that a server listens to.

    Attributes:
        sender: Its index, as in headers.
        key: Its public key, None where there are no keys.
        rate: Largest rate of its messages in the long run [1/s].
        session: That of its present session, 0 for none.
        last: That of its last session, 0 before the first.
        route: Its connection, None for none.
        incoming: What came in this session.
        outgoing: What is sent to it in this session.
        unsent: Messages that could not be sent to it, in all sessions.
        sessions: Number of its sessions.
        heard: When it was heard last, by a clock that never goes back [s].
        offers: Connections to which a session was offered that has not begun, with the session.
    """

    sender: int
    key: str | None = None
    rate: float = RATE
    session: int = 0
    last: int = 0
    route: bytes | None = None
    incoming: Incoming = field(default_factory=Incoming)
    outgoing: Outgoing = field(default_factory=Outgoing)
    unsent: int = 0
    sessions: int = 0
    heard: float = -math.inf
    offers: dict[bytes, int] = field(default_factory=dict)

    @property
    def sent(self) -> int:
        """Messages sent to it in this session, see :class:`Outgoing`."""
        return self.outgoing.sent

    def taken(self, route: bytes, now: float) -> bool:
        """Whether another connection has this name and is being heard."""
        return self.route is not None and self.route != route and now - self.heard < SILENCE

    def offer(self, route: bytes) -> int:
        """Return the session of a connection, drawn when it first asks; its first message begins it."""
        if route == self.route:
            return self.session
        if route in self.offers:
            return self.offers[route]
        while len(self.offers) >= _MOST_OFFERS:
            del self.offers[next(iter(self.offers))]
        self.offers[route] = secrets.choice([number for number in _SESSIONS if number != self.last])
        return self.offers[route]

    def begin(self, route: bytes) -> None:
        """Begin the session that was offered to a connection; the one before is over."""
        self.session = self.last = self.offers.pop(route)
        self.route = route
        self.incoming, self.sessions = Incoming(self.rate), self.sessions + 1
        self.outgoing.restart()

    def end(self) -> None:
        """End the session: the connection is gone."""
        self.session, self.route = 0, None
