"""The end of a channel that connects to one server."""

from __future__ import annotations

import math
import secrets
from time import monotonic
from typing import Any

import zmq

from coop_drake.messages.agreement import ANY_QUESTION, OTHER_VERSION, REASONS, Question, Tap
from coop_drake.messages.codec import OPENING, decode, encode, header_of
from coop_drake.messages.incoming import Incoming
from coop_drake.messages.keys import KeyPair
from coop_drake.messages.outgoing import SOUND, Links, Outgoing
from coop_drake.messages.refusals import Reason, Refusals, RefusedError
from coop_drake.messages.schema import WORLD, Hello, Present, TurnedAway, Welcome
from coop_drake.messages.sockets import FAILURES, next_event, next_parts, open_socket, wait_for, watch_socket
from coop_drake.messages.wire import KINDS, Channel, Role, allowed_kinds

_AGAIN = 0.1
"""Time after which a process asks again to be heard [s]."""

_READ_AT_ONCE = 4096
"""Messages that one call reads at most where all of them are refused."""


class MessageClient:
    """Connects to a server, asks to be heard, and again after every break of the connection.

    Nothing that arrives raises an error. Everything is done inside the calls of :meth:`receive`.

    Args:
        address: Where the server listens.
        server: Index of the server.
        channel: What the messages are about.
        sender: Its own index.
        question: What both ends must agree on.
        keys: Its own keys, None for no encryption.
        server_key: The server's public key, None for no encryption.
        context: Of ZeroMQ; a new one by default. The address ``inproc://...`` needs a common one.
        tap: Is shown every message.
        links: What goes wrong with messages that it sends.

    Attributes:
        address: Where the server listens.
        server: Index of the server.
        trouble: Why there is no session, where there is none.
        session: Number of the session, 0 where there is none.
        sessions: How many there have been.
        incoming: What came in this session.
        outgoing: What is sent in this session.
        unsent: Messages that could not be sent.
        heard: When the server was heard last [s].
        refusals: What was refused.
    """

    def __init__(
        self,
        address: str,
        server: int,
        *,
        channel: Channel,
        sender: int,
        question: Question = ANY_QUESTION,
        keys: KeyPair | None = None,
        server_key: str | None = None,
        context: zmq.Context[Any] | None = None,
        tap: Tap | None = None,
        links: Links = SOUND,
    ) -> None:
        self.address, self.session, self.sessions, self.unsent = address, 0, 0, 0
        self.outgoing = Outgoing(links.between(channel, sender, server))
        self.incoming, self.refusals, self.heard = Incoming(None), Refusals(), -math.inf
        self.server, self.trouble = server, "nothing answers there"
        self._sender, self._question, self._tap = sender, question, tap
        role: Role = "world" if server == WORLD else "supervisor"
        self._allowed = allowed_kinds(channel, ("server", "both", role))
        self._nonce, self._asked = secrets.randbits(32), -math.inf
        self._own_context = None if context else zmq.Context()
        used = context or self._own_context
        assert used is not None
        self._socket = open_socket(used, zmq.DEALER, keys)
        self._socket.setsockopt(zmq.IMMEDIATE, 1)
        if server_key is not None:
            self._socket.curve_serverkey = server_key.encode()
        self._monitor = watch_socket(self._socket, zmq.EVENT_HANDSHAKE_SUCCEEDED | zmq.EVENT_DISCONNECTED)
        self._socket.connect(address)

    @property
    def sent(self) -> int:
        """Messages sent in this session, see :class:`Outgoing`."""
        return self.outgoing.sent

    @property
    def sockets(self) -> list[zmq.Socket[bytes]]:
        """The sockets to wait on: messages and events of connections."""
        return [self._socket, self._monitor]

    @property
    def patience(self) -> float:
        """Longest time between two calls of :meth:`poll` while there is no session, else infinity [s]."""
        return math.inf if self.session else _AGAIN

    def receive(self, limit: float = 0.0) -> Any | None:
        """Return the next message of the server, None where nothing is there in time.

        Args:
            limit: Longest time to wait [s].
        """
        deadline = monotonic() + limit
        while True:
            message, left = self.poll(), deadline - monotonic()
            if message is not None or left <= 0.0:
                return message
            wait_for(self.sockets, min(left, self.patience))

    def poll(self) -> Any | None:
        """Return a message that has arrived, None where there is none; asks for a session where needed."""
        while (event := next_event(self._monitor)) is not None:
            if event in FAILURES:
                self.trouble = "the connection was refused: a key is missing or wrong"
            elif event == zmq.Event.DISCONNECTED:
                # The next server may be another process, which does not know the session.
                self.session, self._nonce = 0, secrets.randbits(32)
            elif not self.session:
                self._asked = -math.inf
        for _ in range(_READ_AT_ONCE):
            parts = next_parts(self._socket)
            if parts is None:
                break
            if (message := self._take(parts)) is not None:
                return message
        if not self.session and monotonic() - self._asked >= _AGAIN:
            self._asked = monotonic()
            self._put(encode(Hello(self._nonce, *self._question), self._sender, 0, 0))
        return None

    def send(self, message: Any) -> bool:
        """Send a message; False where there is no session, the server does not take it or will not get it."""
        sent = self.session != 0 and self.outgoing.send(message, self._sender, self.session, self._put)
        self.unsent += not sent
        return sent

    def begin(self, sample: int) -> None:
        """Begin a sample by its number."""
        self.outgoing.sample = sample

    def release(self) -> None:
        """Send what is late and due."""
        self.outgoing.release(self._put)

    def close(self) -> None:
        """Close everything; what was sent may leave for a fifth of a second."""
        if self._socket.closed:
            return
        self._socket.disable_monitor()
        self._monitor.close()
        self._socket.close()
        if self._own_context is not None:
            self._own_context.term()

    def _take(self, parts: list[zmq.Frame]) -> Any | None:
        """Return a message, None where it is about a session or is refused."""
        data = parts[0].bytes
        if self._tap is not None:
            self._tap("received", self.server, data)
        try:
            if len(parts) > 1:
                raise RefusedError(Reason.PARTS)
            header = header_of(data)
            if header.kind in OPENING:
                if header.sender != self.server:
                    raise RefusedError(Reason.SENDER)
                self._answered(decode(data, header, _OPENING))
                return None
            if not self.session or header.session != self.session:
                raise RefusedError(Reason.SESSION)
            message = decode(data, header, self._allowed)
            self.incoming.take(header.sequence)
        except RefusedError as refused:
            self.refusals.add(refused.reason)
            if refused.reason is Reason.VERSION:
                self.trouble = REASONS[OTHER_VERSION]
            return None
        self.heard = monotonic()
        return message

    def _answered(self, answer: Any) -> None:
        """Begin the session that is offered, or remember why there is none."""
        if answer.nonce != self._nonce:
            raise RefusedError(Reason.SESSION)
        if self.session:
            return  # The answer to a question that was asked again meanwhile.
        if isinstance(answer, TurnedAway):
            self.trouble = REASONS.get(answer.reason, "it does not know this process")
            return
        self.session, self.incoming = answer.session, Incoming(None)
        self.outgoing.restart()
        self.sessions, self.heard = self.sessions + 1, monotonic()
        self.send(Present())

    def _put(self, data: bytes) -> bool:
        try:
            self._socket.send(data, zmq.NOBLOCK)
        except zmq.Again:
            return False
        if self._tap is not None:
            self._tap("sent", self.server, data)
        return True


_OPENING = frozenset((KINDS[Welcome].code, KINDS[TurnedAway].code))
"""Messages that answer a ``Hello``."""
