"""The end of a channel that listens, and to which many processes connect."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from time import monotonic
from typing import Any

import zmq

from coop_drake.errors import MessagingError
from coop_drake.messages.agreement import (
    ANY_QUESTION,
    OTHER_KEY,
    OTHER_PLAN,
    OTHER_SCENARIO,
    OTHER_VERSION,
    TAKEN,
    Question,
    Tap,
)
from coop_drake.messages.codec import Header, decode, encode, header_of, turned_away_by_version
from coop_drake.messages.doorkeeper import Doorkeeper
from coop_drake.messages.incoming import RATE
from coop_drake.messages.keys import KeyPair
from coop_drake.messages.outgoing import SOUND, Links, Outgoing
from coop_drake.messages.peers import Peer
from coop_drake.messages.refusals import Reason, Refusals, RefusedError
from coop_drake.messages.schema import SUPERVISOR, Hello, TurnedAway, Welcome
from coop_drake.messages.sockets import next_event, next_parts, open_socket, wait_for, watch_socket
from coop_drake.messages.wire import KINDS, Channel, allowed_kinds

_READ_AT_ONCE = 256
"""Messages that one call reads at most where all of them are refused: a flood cannot keep it for ever."""


class MessageServer:
    """Listens at an address to the processes that it knows, and answers each of them.

    Nothing that arrives raises an error: what departs from the schema, or comes from somebody else, is
    refused and counted. Everything is done inside the calls of :meth:`receive`, by the thread that calls.

    Args:
        address: Where to listen, for example ``tcp://127.0.0.1:*``; ``*`` is any free port.
        peers: Indices of the processes that may connect, with their public keys, or None for each.
        channel: What the messages are about.
        sender: Its own index.
        question: What both ends must agree on.
        keys: Its own keys, None for no encryption.
        context: Of ZeroMQ; a new one by default. The address ``inproc://...`` needs a common one.
        tap: Is shown every message.
        rate: Largest rate of the messages of each process in the long run [1/s].
        links: What goes wrong with messages that it sends.

    Raises:
        MessagingError: It cannot listen at the address.

    Attributes:
        address: Where it listens, with its port.
        peers: What it knows about each process.
        refusals: What was refused.
    """

    def __init__(
        self,
        address: str,
        peers: Mapping[int, str | None],
        *,
        channel: Channel,
        sender: int,
        question: Question = ANY_QUESTION,
        keys: KeyPair | None = None,
        context: zmq.Context[Any] | None = None,
        tap: Tap | None = None,
        rate: float = RATE,
        links: Links = SOUND,
    ) -> None:
        self.peers = {
            index: Peer(index, key, rate, outgoing=Outgoing(links.between(channel, sender, index)))
            for index, key in peers.items()
        }
        self.refusals = Refusals()
        self._sender, self._question, self._tap = sender, question, tap
        self._allowed = {
            index: allowed_kinds(
                channel, ("client", "both", "supervisor" if index == SUPERVISOR else "robot")
            )
            for index in peers
        }
        self._routes: dict[bytes, Peer] = {}
        self._own_context = None if context else zmq.Context()
        self._context = context or self._own_context
        assert self._context is not None
        self._doorkeeper = Doorkeeper(self._context, peers.values()) if keys else None
        self._socket = open_socket(self._context, zmq.ROUTER, keys)
        self._socket.setsockopt(zmq.ROUTER_MANDATORY, 1)
        if keys is not None:
            self._socket.curve_server = True
            # Without these nobody would be asked about keys if the thread that answers were not there.
            self._socket.zap_domain, self._socket.zap_enforce_domain = b"team", 1
        self._monitor = watch_socket(self._socket)
        try:
            self._socket.bind(address)
        except zmq.ZMQError as error:
            self.close()
            raise MessagingError(f"{address}: cannot listen there: {error.strerror.lower()}") from error
        self.address = self._socket.getsockopt_string(zmq.LAST_ENDPOINT)

    @property
    def sockets(self) -> list[zmq.Socket[bytes]]:
        """The sockets to wait on: messages and events of connections."""
        return [self._socket, self._monitor]

    def receive(self, limit: float = 0.0) -> tuple[int, Any] | None:
        """Return the index of a sender and its message, None where nothing is there in time.

        The first message of every session is :class:`~coop_drake.messages.schema.Present`.

        Args:
            limit: Longest time to wait [s].
        """
        deadline = monotonic() + limit
        while True:
            for _ in range(_READ_AT_ONCE):
                parts = next_parts(self._socket)
                if parts is None:
                    break
                if (taken := self._take(parts)) is not None:
                    return taken
            while next_event(self._monitor) is not None:
                self.refusals.add(Reason.HANDSHAKE)
            left = deadline - monotonic()
            if left <= 0.0:
                return None
            wait_for(self.sockets, left)

    def send(self, peer: int, message: Any) -> bool:
        """Send a message to a process; False where it has no session, does not take it or will not get it."""
        known = self.peers[peer]
        sent = known.route is not None and known.outgoing.send(
            message, self._sender, known.session, partial(self._put, known, known.route)
        )
        known.unsent += not sent
        return sent

    def begin(self, sample: int) -> None:
        """Begin a sample by its number."""
        for peer in self.peers.values():
            peer.outgoing.sample = sample

    def release(self) -> dict[int, list[Any]]:
        """Send what is late and due; return the messages that each process takes."""
        return {
            index: peer.outgoing.release(partial(self._put, peer, peer.route or b""))
            for index, peer in self.peers.items()
        }

    def close(self) -> None:
        """Close everything; what was sent may leave for a fifth of a second."""
        if self._socket.closed:
            return
        if self._doorkeeper is not None:
            self._doorkeeper.close()
        self._socket.disable_monitor()
        self._monitor.close()
        self._socket.close()
        if self._own_context is not None:
            self._own_context.term()

    def _take(self, parts: list[zmq.Frame]) -> tuple[int, Any] | None:
        """Return the sender and the message, None where it opens a session or is refused."""
        route, data = parts[0].bytes, parts[1].bytes if len(parts) > 1 else b""
        peer = self._routes.get(route)
        if self._tap is not None:
            self._tap("received", peer.sender if peer else -1, data)
        try:
            if len(parts) > 2:
                raise RefusedError(Reason.PARTS)
            header = header_of(data)
            if header.kind == KINDS[Hello].code:
                self._greet(route, header, data, parts[1])
                return None
            peer = self._session(peer, route, header)
            peer.incoming.limit(monotonic())
            message = decode(data, header, self._allowed[peer.sender])
            peer.incoming.take(header.sequence)
        except RefusedError as refused:
            self.refusals.add(refused.reason)
            if refused.reason is Reason.VERSION:
                self._answer_other_version(route, data)
            return None
        peer.heard = monotonic()
        return peer.sender, message

    def _session(self, peer: Peer | None, route: bytes, header: Header) -> Peer:
        """Return the process that has the session of a message, which may begin it."""
        if peer is None:
            raise RefusedError(Reason.SESSION)
        if peer.offers.get(route) == header.session:
            if peer.taken(route, monotonic()):
                raise RefusedError(Reason.SENDER)
            if peer.route not in (None, route):
                self._routes.pop(peer.route or b"", None)
            peer.begin(route)
        if peer.route != route or peer.session != header.session:
            raise RefusedError(Reason.SESSION)
        return peer

    def _greet(self, route: bytes, header: Header, data: bytes, frame: zmq.Frame) -> None:
        """Offer a session, or turn a process away."""
        hello = decode(data, header, (header.kind,))
        peer = self.peers.get(header.sender)
        if peer is None:
            raise RefusedError(Reason.SENDER)
        reason = self._objection(peer, route, hello, frame)
        answer: Any = TurnedAway(hello.nonce, reason)
        if not reason:
            answer = Welcome(hello.nonce, self._offer(peer, route))
        self._put(peer, route, encode(answer, self._sender, 0, 0))
        if reason == OTHER_KEY:
            raise RefusedError(Reason.SENDER)

    def _answer_other_version(self, route: bytes, data: bytes) -> None:
        """Tell a process that speaks another version why it is turned away, in words of its own version."""
        answer = turned_away_by_version(data, OTHER_VERSION, self._sender)
        known = self.peers.get(data[4]) if len(data) > 4 else None
        if answer is not None and known is not None:
            self._put(known, route, answer)

    def _offer(self, peer: Peer, route: bytes) -> int:
        """Draw a session for a connection and forget the connections whose offers have lapsed."""
        before = set(peer.offers)
        session = peer.offer(route)
        for lapsed in before - set(peer.offers) - {peer.route}:
            self._routes.pop(lapsed or b"", None)
        self._routes[route] = peer
        return session

    def _objection(self, peer: Peer, route: bytes, hello: Hello, frame: zmq.Frame) -> int:
        """Return the reason why a process is turned away, 0 for none."""
        if self._doorkeeper is not None and frame.get("User-Id") != peer.key:
            return OTHER_KEY
        if hello.scenario != self._question.scenario:
            return OTHER_SCENARIO
        if hello.plan != self._question.plan:
            return OTHER_PLAN
        return TAKEN if peer.taken(route, monotonic()) else 0

    def _put(self, peer: Peer, route: bytes, data: bytes) -> bool:
        """Send bytes to a connection; False where it is gone or full."""
        try:
            self._socket.send_multipart([route, data], zmq.NOBLOCK)
        except zmq.Again:
            return False
        except zmq.ZMQError as error:
            if error.errno != zmq.EHOSTUNREACH:
                raise
            if peer.route == route:
                peer.end()
            self._routes.pop(route, None)
            return False
        if self._tap is not None:
            self._tap("sent", peer.sender, data)
        return True
