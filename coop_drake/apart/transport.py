"""Sockets of ZeroMQ between the processes of a team: connections, sessions, and what is refused."""

from __future__ import annotations

import math
import secrets
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import zmq
import zmq.utils.monitor
from zmq.auth.thread import ThreadAuthenticator

from coop_drake.apart.faults import NO_FAULTS, ChannelFaults, Faults, Link
from coop_drake.apart.messages import (
    LONGEST,
    PROTOCOL,
    SUPERVISOR,
    UNNUMBERED,
    WORLD,
    Hello,
    Message,
    Reason,
    Refusals,
    Refused,
    RefusedError,
    Welcome,
    channel_of,
    decode,
    decoder_of,
    encode,
    name_of,
    protocol_of,
)
from coop_drake.apart.team_files import AddressBook, KeyPair
from coop_drake.errors import MessagingError

Received = tuple[int, Message]
"""Index of a sender and its message."""

_HIGH_WATER = 1000
"""Messages that wait for one connection; at 200 Hz those of five seconds. Further ones are not sent."""

_ALIVE, _DEAD = 500, 2000
"""Time between two signs of life of ZeroMQ, and without them until a connection is closed [ms]."""

_AGAIN = 0.1
"""Time after which a process asks again for a session [s]."""

_READ_AT_ONCE = 256
"""Messages that one call reads at most where all of them are refused: a flood cannot keep it for ever."""

_FAILURES = (
    zmq.Event.HANDSHAKE_FAILED_NO_DETAIL
    | zmq.Event.HANDSHAKE_FAILED_PROTOCOL
    | zmq.Event.HANDSHAKE_FAILED_AUTH
)
"""Events of a connection that does not come about."""


@dataclass(frozen=True)
class Network:
    """What a process needs to speak with its team.

    Attributes:
        book: Who listens where, and who is known by which key.
        scenario: Digest of the scenario; both ends of a connection must have the same.
        plan: The same of the plan.
        keys: The process' own keys, None where the book has none.
        faults: What goes wrong with messages that the process sends, and with robots' clocks.
        period: Control period [s].
    """

    book: AddressBook
    scenario: str = ""
    plan: str = ""
    keys: KeyPair | None = None
    faults: Faults = NO_FAULTS
    period: float = 1.0

    def link(self, sender: int, receiver: int) -> Link | None:
        """Return what goes wrong with messages from one process to another, None for nothing."""
        channel = channel_of(sender, receiver)
        sound = getattr(self.faults, channel) == ChannelFaults()
        return None if sound else Link(channel, self.faults, self.period, sender, receiver)


class Session:
    """One end of a session: numbers of its messages, and what a faulty link does to those that are sent.

    Args:
        link: What goes wrong with messages that are sent; None for nothing.

    Attributes:
        number: Number of the session.
        sent: Messages that the receiver takes: neither lost, nor so late that they are refused.
    """

    def __init__(self, link: Link | None = None) -> None:
        self._link = link
        self.begin(0)

    def begin(self, number: int) -> None:
        """Begin a session; what is late in the one before never leaves."""
        self.number, self.sent = number, 0
        self._numbered = self._newest = self._taken = 0
        self._late: list[tuple[int, int, Message, bytes]] = []

    def send(self, message: Message, sample: int, put: Callable[[bytes], bool]) -> bool:
        """Send a message; False where it is not sent now.

        Args:
            message: The message.
            sample: Number of the present sample.
            put: Hands bytes to the socket; False where it does not take them.
        """
        if isinstance(message, UNNUMBERED):
            return put(encode(self.number, 0, message))
        number = self._numbered + 1
        data = encode(self.number, number, message)
        copies, late = (1, False) if self._link is None else self._link.fate(message, sample)
        if late and copies and self._link is not None:
            self._late.append((sample + self._link.late_by, number, message, data))
            copies = 0
        elif copies and not put(data):
            return False
        self._numbered = number
        for _ in range(copies - 1):
            put(data)
        return bool(copies) and self._passed(number)

    def release(self, sample: int, put: Callable[[bytes], bool]) -> list[Any]:
        """Send what is late and due at a sample; return the messages that the receiver takes."""
        due = [kept for kept in self._late if kept[0] <= sample]
        self._late = [kept for kept in self._late if kept[0] > sample]
        return [message for _, number, message, data in due if put(data) and self._passed(number)]

    def take(self, number: int) -> None:
        """Take a message by its number.

        Raises:
            RefusedError: The number has been passed.
        """
        if number <= self._taken:
            raise RefusedError(Reason.SEQUENCE)
        self._taken = number

    def _passed(self, number: int) -> bool:
        """Count a message that has left; False where a newer one has, so that it will be refused."""
        newer = number > self._newest
        self.sent += newer
        self._newest = max(number, self._newest)
        return newer


class _Socket:
    """A socket with bounded queues and with signs of life, and the events of its connections.

    Args:
        keys: The process' own keys, None for no encryption.
        refusals: Counts what is refused.
        kind: ``zmq.ROUTER`` or ``zmq.DEALER``.
        events: Which events count beside those of connections that fail.
    """

    def __init__(self, keys: KeyPair | None, refusals: Refusals, kind: int, events: int = 0) -> None:
        self._refusals = refusals
        self._context = zmq.Context()
        self._socket: zmq.Socket[bytes] = self._context.socket(kind)
        self._socket.set_hwm(_HIGH_WATER)
        for option, value in (
            (zmq.LINGER, 200),
            (zmq.MAXMSGSIZE, LONGEST),
            (zmq.HEARTBEAT_IVL, _ALIVE),
            (zmq.HEARTBEAT_TIMEOUT, _DEAD),
            (zmq.RECONNECT_IVL, 20),
            (zmq.RECONNECT_IVL_MAX, 500),
            (zmq.HANDSHAKE_IVL, 5000),
        ):
            self._socket.setsockopt(option, value)
        if keys is not None:
            self._socket.curve_publickey = keys.public.encode()
            self._socket.curve_secretkey = keys.private.encode()
        self._monitor = self._socket.get_monitor_socket(_FAILURES | events)

    @property
    def sockets(self) -> tuple[zmq.Socket[bytes], zmq.Socket[bytes]]:
        """The sockets to wait on: messages and events of connections."""
        return self._socket, self._monitor

    def close(self) -> None:
        """Close everything; what was sent may leave for a fifth of a second."""
        if not self._socket.closed:
            self._socket.disable_monitor()
            self._monitor.close()
            self._socket.close()
            self._context.term()

    def _events(self) -> Iterator[zmq.Event]:
        """Yield the events of connections that have come."""
        while self._monitor.poll(0):
            yield zmq.Event(zmq.utils.monitor.recv_monitor_message(self._monitor)["event"])

    def _frames(self) -> Iterator[list[zmq.Frame]]:
        """Yield messages that have come as their last frames, of which the router's first is a connection."""
        for _ in range(_READ_AT_ONCE):
            try:
                frames = [self._socket.recv(zmq.NOBLOCK, copy=False)]
            except zmq.Again:
                return
            while frames[-1].more:
                frames = [*frames[:2], self._socket.recv(copy=False)]
            yield frames

    def _put(self, frames: Iterable[bytes]) -> bool:
        """Hand a message to the socket; False where it takes no more."""
        try:
            self._socket.send_multipart(tuple(frames), zmq.NOBLOCK)
        except zmq.Again:
            return False
        return True


@dataclass
class Peer:
    """One process that a server listens to.

    Attributes:
        key: Its public key, None where there are no keys.
        session: Its session.
        route: The connection that has the session; None for no session.
    """

    key: str | None
    session: Session = field(default_factory=Session)
    route: bytes | None = None


class Server(_Socket):
    """Listens to the processes that it knows.

    A connection has a session once its ``Hello`` was granted, and no other connection gets the name while it
    is there. Nothing that arrives raises an error: what is malformed, or comes from somebody else, is refused
    and counted.

    Args:
        network: What the process needs to speak with its team.
        index: Its own index; the world listens to all others, the supervisor to robots.
        refusals: Counts what is refused.

    Raises:
        MessagingError: It cannot listen at its address.

    Attributes:
        peers: What it knows about each process.
    """

    def __init__(self, network: Network, index: int, refusals: Refusals) -> None:
        super().__init__(network.keys, refusals, zmq.ROUTER)
        self._network, self._index, book = network, index, network.book
        clients = [*range(len(book.robots)), *([SUPERVISOR] if index == WORLD else [])]
        self.peers = {k: Peer(book.key_of(k), Session(network.link(index, k))) for k in clients}
        self._connected = dict[bytes, int]()
        self._socket.setsockopt(zmq.ROUTER_MANDATORY, 1)
        self._keeper: ThreadAuthenticator | None = None
        if network.keys is not None:
            self._socket.curve_server = True
            # Without these nobody would be asked about keys if the thread that answers were not there.
            self._socket.zap_domain, self._socket.zap_enforce_domain = b"team", 1
            self._keeper = ThreadAuthenticator(self._context)
            self._keeper.start()
            self._keeper.configure_curve_callback(
                "team", credentials_provider=_KnownKeys(self.peers.values())
            )
        address = book.listener(index).address
        try:
            self._socket.bind(address)
        except zmq.ZMQError as error:
            self.close()
            raise MessagingError(f"{address}: cannot listen there: {error.strerror.lower()}") from error

    def poll(self) -> Received | None:
        """Return a sender and its message, first the ``Hello`` of its session; None for nothing."""
        for _ in self._events():
            self._refusals.add(RefusedError(Reason.HANDSHAKE))
        for frames in self._frames():
            try:
                if (taken := self._take(frames)) is not None:
                    return taken
            except RefusedError as refused:
                self._refusals.add(refused)
        return None

    def send(self, index: int, message: Message, sample: int = 0) -> bool:
        """Send a message to a process; False where it has no session, does not take it or will not get it."""
        peer = self.peers[index]
        return peer.route is not None and peer.session.send(message, sample, partial(self._to, peer))

    def release(self, sample: int) -> dict[int, list[Any]]:
        """Send what is late and due at a sample; return the messages that each process takes."""
        return {k: peer.session.release(sample, partial(self._to, peer)) for k, peer in self.peers.items()}

    def present(self) -> set[int]:
        """Return the indices of the processes that have a session."""
        return {index for index, peer in self.peers.items() if peer.route is not None}

    def close(self) -> None:
        """See ``_Socket``."""
        if self._keeper is not None:
            self._keeper.stop()
            self._keeper = None
        super().close()

    def _take(self, frames: list[zmq.Frame]) -> Received | None:
        """Return a sender and its message; None where it repeats its ``Hello``.

        Raises:
            RefusedError: The message is refused.
        """
        if len(frames) != 2:
            raise RefusedError(Reason.MALFORMED, f"Expected one frame, got {len(frames) - 1} or more")
        route, data = frames[0].bytes, frames[1].bytes
        index = self._connected.get(route)
        if index is None:
            return self._greet(route, data, frames[1])
        peer = self.peers[index]
        session, number, message = decode(data, decoder_of(index, self._index))
        if session != peer.session.number:
            raise RefusedError(Reason.SESSION)
        if isinstance(message, Hello):  # It has asked again before it has read the answer.
            self.send(index, Welcome())
            return None
        peer.session.take(number)
        return index, message

    def _greet(self, route: bytes, data: bytes, frame: zmq.Frame) -> Received:
        """Begin the session that a new connection asks for.

        Raises:
            RefusedError: It gets none.
        """
        opening = protocol_of(data)
        if opening is None:
            raise RefusedError(Reason.SESSION)

        def refuse(words: str) -> None:
            self._put((route, encode(opening[0], 0, Refused(words))))

        if opening[1] != PROTOCOL:
            refuse(f"it speaks protocol {PROTOCOL}, not {opening[1]}")
            raise RefusedError(Reason.VERSION)
        session, _, hello = decode(data)
        peer = self.peers.get(hello.sender)
        if peer is None:
            refuse("it knows no process of this name")
            raise RefusedError(Reason.SENDER)
        if self._keeper is not None and frame.get("User-Id") != peer.key:
            refuse("its address book has another key for this name")
            raise RefusedError(Reason.SENDER)
        if words := self._objection(hello, peer):
            refuse(words)
            raise RefusedError(Reason.SESSION)
        self._connected[route], peer.route = hello.sender, route
        peer.session.begin(session)
        self.send(hello.sender, Welcome())
        return hello.sender, hello

    def _objection(self, hello: Hello, peer: Peer) -> str:
        """Return why a known process gets no session, nothing where it gets one."""
        if hello.scenario != self._network.scenario:
            return "it has another scenario"
        if hello.plan != self._network.plan:
            return "it has another plan"
        # A connection is there until the library has noticed that it is not, after two seconds at most.
        there = self.send(hello.sender, Welcome()) or peer.route is not None
        return "another process of this name is connected" if there else ""

    def _to(self, peer: Peer, data: bytes) -> bool:
        """Send bytes to a process; False where its connection is full, or gone, and the session with it."""
        assert peer.route is not None
        try:
            return self._put((peer.route, data))
        except zmq.ZMQError as error:
            if error.errno != zmq.EHOSTUNREACH:
                raise
            self._connected.pop(peer.route, None)
            peer.route = None
            return False


class _KnownKeys:
    """Lets only known keys connect, as ZeroMQ's authentication protocol (ZAP) asks for each connection."""

    def __init__(self, peers: Iterable[Peer]) -> None:
        self._keys = {peer.key.encode() for peer in peers if peer.key}

    def callback(self, domain: str, key: bytes) -> bool:
        """Whether a client that has proved to have the private key of a public one may connect."""
        return key in self._keys


class Client(_Socket):
    """Connects to a server, asks for a session, and again after every break of the connection.

    Args:
        network: What the process needs to speak with its team.
        index: Its own index.
        server: Index of the server.
        refusals: Counts what is refused.

    Attributes:
        address: Where the server listens.
        session: The session.
        sessions: How many there have been.
        open: Whether there is one.
        trouble: Why there is none, where there is none.
    """

    def __init__(self, network: Network, index: int, server: int, refusals: Refusals) -> None:
        connections = zmq.Event.HANDSHAKE_SUCCEEDED | zmq.Event.DISCONNECTED
        super().__init__(network.keys, refusals, zmq.DEALER, connections)
        self.address, self.trouble = network.book.listener(server).address, "nothing answers there"
        self.session, self.sessions = Session(network.link(index, server)), 0
        self._server, self._decoder = server, decoder_of(server, index)
        self._hello = Hello(PROTOCOL, index, network.scenario, network.plan)
        self._restart()
        self._socket.setsockopt(zmq.IMMEDIATE, 1)
        if (key := network.book.key_of(server)) is not None:
            self._socket.curve_serverkey = key.encode()
        self._socket.connect(self.address)

    def _restart(self) -> None:
        """Ask for another session: the next server may be another process, which does not know this one."""
        self.open, self._asked = False, -math.inf
        self.session.begin(secrets.randbits(32))

    def poll(self) -> Received | None:
        """Return the server and its message, first the ``Welcome`` of a session; None for nothing."""
        for frames in self._frames():
            try:
                if (message := self._take(frames)) is not None:
                    return self._server, message
            except RefusedError as refused:
                self._refusals.add(refused)
        # Only now: a goodbye comes just before its connection ends.
        for event in self._events():
            if event & _FAILURES:
                self._refusals.add(RefusedError(Reason.HANDSHAKE))
                self.trouble = "the connection was refused: a key is missing or wrong"
            elif event == zmq.Event.DISCONNECTED:
                self._restart()
            elif not self.open:
                self._asked = -math.inf
        if not self.open and time.monotonic() - self._asked >= _AGAIN:
            self._asked = time.monotonic()
            self.session.send(self._hello, 0, self._to)
        return None

    def send(self, message: Message, sample: int = 0) -> bool:
        """Send a message; False where there is no session, the server does not take it or will not get it."""
        return self.open and self.session.send(message, sample, self._to)

    def release(self, sample: int) -> None:
        """Send what is late and due at a sample."""
        self.session.release(sample, self._to)

    def _to(self, data: bytes) -> bool:
        return self._put((data,))

    def _take(self, frames: list[zmq.Frame]) -> Any | None:
        """Return a message; None where it says nothing new about the session.

        Raises:
            RefusedError: The message is refused.
        """
        if len(frames) != 1:
            raise RefusedError(Reason.MALFORMED, "Expected one frame, got several")
        session, number, message = decode(frames[0].bytes, self._decoder)
        if session != self.session.number or not (self.open or isinstance(message, Welcome | Refused)):
            raise RefusedError(Reason.SESSION)
        if isinstance(message, Refused) and not self.open:
            self.trouble = message.reason
        if isinstance(message, Welcome) and not self.open:
            self.open, self.sessions = True, self.sessions + 1
            return message
        if isinstance(message, Welcome | Refused):
            return None
        if not isinstance(message, UNNUMBERED):
            self.session.take(number)
        return message


class Ends:
    """All ends of one process, waited for together: a server, clients, or both.

    Args:
        network: What the process needs to speak with its team.
        index: Its index.

    Attributes:
        sample: Number of the present sample, on which faults of messages depend.
        server: The end at which it listens; None for a robot.
        clients: The ends that connect to others, by their indices.
        refusals: What was refused.
    """

    def __init__(self, network: Network, index: int) -> None:
        self.sample, self._arrived, refusals = 0, deque[Received](), Refusals(name_of(index))
        self.clients = {k: Client(network, index, k, refusals) for k in (WORLD, SUPERVISOR) if k > index}
        self.server = Server(network, index, refusals) if index in (WORLD, SUPERVISOR) else None
        self.refusals = refusals
        self._awaits_all = index == WORLD
        self._all: list[Server | Client] = [*self.clients.values(), *([self.server] if self.server else [])]
        self._poller, self._owners = zmq.Poller(), dict[Any, Server | Client]()
        for end in self._all:
            for socket in end.sockets:
                self._poller.register(socket, zmq.POLLIN)
                self._owners[socket] = end

    def send(self, index: int, message: Message) -> bool:
        """Send a message to a process; False where it has no session, does not take it or will not get it."""
        if index in self.clients:
            return self.clients[index].send(message, self.sample)
        return self.server is not None and self.server.send(index, message, self.sample)

    def sent(self, index: int) -> int:
        """Return how many messages a process takes in its session, 0 without one."""
        if index in self.clients:
            client = self.clients[index]
            return client.session.sent if client.open else 0
        peer = self.server.peers[index] if self.server else Peer(None)
        return peer.session.sent if peer.route is not None else 0

    def receive(self, limit: float = 0.0) -> Received | None:
        """Return the index of a sender and its message, None where nothing is there in time.

        Messages of one sender come in their order, those of several senders in any.

        Args:
            limit: Longest time to wait [s].
        """
        deadline = time.monotonic() + limit
        while not self._arrived:
            left = deadline - time.monotonic()
            self._poll(left)
            if not self._arrived and left <= 0.0:
                return None
        return self._arrived.popleft()

    def present(self) -> set[int]:
        """Return the indices of the processes with which there are sessions."""
        asked = {index for index, client in self.clients.items() if client.open}
        return asked | (self.server.present() if self.server else set())

    def release(self) -> dict[int, list[Any]]:
        """Send what is late and due, after what is new; return what each process takes of the server's."""
        for client in self.clients.values():
            client.release(self.sample)
        return self.server.release(self.sample) if self.server else {}

    def open(self, limit: float) -> None:
        """Wait for sessions with all servers, or where this is the world with all others.

        Messages that arrive meanwhile are kept for :meth:`receive`.

        Raises:
            MessagingError: There are none in time; it says who does not answer, where and why.
        """
        deadline = time.monotonic() + limit
        while words := self._missing():
            left = deadline - time.monotonic()
            self._poll(left)
            if left <= 0.0 and self._missing():
                raise MessagingError(f"{words} (waited for {limit:g} s)")

    def close(self) -> None:
        """Close all sockets."""
        for end in self._all:
            end.close()

    def _missing(self) -> str:
        """Say with whom there are no sessions yet."""
        if self.server is not None and self._awaits_all:
            missing = sorted(self.server.peers.keys() - self.present())
            return "no message came from " + ", ".join(map(name_of, missing)) if missing else ""
        asking = [(name_of(k), client) for k, client in self.clients.items() if not client.open]
        return "; ".join(f"{name} at {client.address}: {client.trouble}" for name, client in asking)

    def _poll(self, seconds: float) -> None:
        """Wait until something comes, then take one message of every end, so that none waits for another."""
        asking = [client for client in self.clients.values() if not client.open]
        limit = min(max(seconds, 0.0), _AGAIN if asking else math.inf)
        ready = [self._owners[socket] for socket, _ in self._poller.poll(math.ceil(1e3 * limit))]
        for end in dict.fromkeys((*ready, *asking)):
            if (taken := end.poll()) is not None:
                self._arrived.append(taken)
