"""Sockets of ZeroMQ between the processes of a team: connections, sessions, and what is refused."""

from __future__ import annotations

import math
import secrets
import time
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import zmq
import zmq.utils.monitor
from zmq.auth.thread import ThreadAuthenticator

from coop_drake.apart import messages
from coop_drake.apart.faults import NO_FAULTS, ChannelFaults, Faults, Link
from coop_drake.apart.team_files import AddressBook, KeyPair
from coop_drake.errors import MessagingError

Received = tuple[int, messages.Message]
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
        passes: Whether the team passes from cell to cell, so that robots speak to each other, too.

    Raises:
        ScenarioError: Robots shall speak to each other, and the book does not say where they listen.
    """

    book: AddressBook
    scenario: str = ""
    plan: str = ""
    keys: KeyPair | None = None
    faults: Faults = NO_FAULTS
    period: float = 1.0
    passes: bool = False

    def __post_init__(self) -> None:
        for k in range(1, len(self.book.robots) if self.passes else 0):
            self.book.address_of(k)

    def partners(self, index: int) -> list[int]:
        """Return all with whom a process speaks."""
        robots = [*range(len(self.book.robots))]
        others = [*robots, messages.SUPERVISOR, messages.WORLD]
        if index < messages.SUPERVISOR and not self.passes:
            others = others[-2:]
        return [other for other in others if other != index]

    def link(self, sender: int, receiver: int) -> Link | None:
        """Return what goes wrong with messages from one process to another, None for nothing."""
        channel = messages.channel_of(sender, receiver)
        sound = getattr(self.faults, channel) == ChannelFaults()
        return None if sound else Link(channel, self.faults, self.period, sender, receiver)


class Session:
    """One end of a session: numbers of its messages, and what a faulty link does to those that are sent.

    Args:
        put: Hands bytes to the connection; False where it does not take them.
        link: What goes wrong with messages that are sent; None for nothing.

    Attributes:
        number: Number of the session.
        open: Whether both ends have it.
        count: How many there have been.
        sent: Messages that the receiver takes: neither lost, nor so late that they are refused.
    """

    def __init__(self, put: Callable[[bytes], bool], link: Link | None) -> None:
        self._put, self._link, self.count = put, link, 0
        self.begin(0, is_open=False)

    def begin(self, number: int, *, is_open: bool) -> None:
        """Begin a session, or ask for one; what is late in the one before never leaves."""
        self.number, self.open, self.sent = number, is_open, 0
        self.count += is_open
        self._numbered = self._newest = self._taken = 0
        self._late: list[tuple[int, int, messages.Message, bytes]] = []

    def tell(self, message: messages.Message) -> bool:
        """Send a message about the session itself; False where the connection does not take it."""
        return self._put(messages.encode(self.number, 0, message))

    def send(self, message: messages.Message, sample: int) -> bool:
        """Send a message at a sample; False where it is not sent now, or there is no session."""
        if not self.open or isinstance(message, messages.UNNUMBERED):
            return self.open and self.tell(message)
        number = self._numbered + 1
        data = messages.encode(self.number, number, message)
        copies, late = (1, False) if self._link is None else self._link.fate(message, sample)
        if late and copies and self._link is not None:
            self._late.append((sample + self._link.late_by, number, message, data))
            copies = 0
        elif copies and not self._put(data):
            return False
        self._numbered = number
        for _ in range(copies - 1):
            self._put(data)
        return bool(copies) and self._passed(number)

    def release(self, sample: int) -> list[Any]:
        """Send what is late and due at a sample; return the messages that the receiver takes."""
        due = [kept for kept in self._late if kept[0] <= sample]
        self._late = [kept for kept in self._late if kept[0] > sample]
        return [message for _, number, message, data in due if self._put(data) and self._passed(number)]

    def take(self, number: int) -> None:
        """Take a message by its number.

        Raises:
            RefusedError: The number has been passed.
        """
        if number <= self._taken:
            raise messages.RefusedError(messages.Reason.SEQUENCE)
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

    def __init__(self, keys: KeyPair | None, refusals: messages.Refusals, kind: int, events: int = 0) -> None:
        self._refusals = refusals
        self._context = zmq.Context()
        self._socket: zmq.Socket[bytes] = self._context.socket(kind)
        self._socket.set_hwm(_HIGH_WATER)
        for option, value in (
            (zmq.LINGER, 2000),
            (zmq.MAXMSGSIZE, messages.LONGEST),
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
        """Close everything; what was sent may leave for two seconds."""
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


class Server(_Socket):
    """Listens to the processes that it knows.

    A connection has a session once its ``Hello`` was granted, and no other connection gets the name while it
    is there. Nothing that arrives raises an error: what is malformed, or comes from somebody else, is refused
    and counted.

    Args:
        network: What the process needs to speak with its team.
        index: Its own index; it listens to those with smaller ones.
        refusals: Counts what is refused.

    Raises:
        MessagingError: It cannot listen at its address.

    Attributes:
        sessions: Sessions with all processes that it knows, by their indices.
    """

    def __init__(self, network: Network, index: int, refusals: messages.Refusals) -> None:
        super().__init__(network.keys, refusals, zmq.ROUTER)
        self._network, self._index, book = network, index, network.book
        clients = [other for other in network.partners(index) if other < index]
        self.sessions = {k: Session(partial(self._to, k), network.link(index, k)) for k in clients}
        self._connected, self._routes = dict[bytes, int](), dict[int, bytes]()
        self._socket.setsockopt(zmq.ROUTER_MANDATORY, 1)
        self._keeper: ThreadAuthenticator | None = None
        if network.keys is not None:
            self._socket.curve_server = True
            # Without these nobody would be asked about keys if the thread that answers were not there.
            self._socket.zap_domain, self._socket.zap_enforce_domain = b"team", 1
            self._keeper = ThreadAuthenticator(self._context)
            self._keeper.start()
            known = _KnownKeys(map(book.key_of, clients))
            self._keeper.configure_curve_callback("team", credentials_provider=known)
        address = book.address_of(index)
        try:
            self._socket.bind(address)
        except zmq.ZMQError as error:
            self.close()
            raise MessagingError(f"{address}: cannot listen there: {error.strerror.lower()}") from error

    def poll(self) -> Received | None:
        """Return a sender and its message, first the ``Hello`` of its session; None for nothing."""
        for _ in self._events():
            self._refusals.add(messages.RefusedError(messages.Reason.HANDSHAKE))
        for frames in self._frames():
            try:
                if (taken := self._take(frames)) is not None:
                    return taken
            except messages.RefusedError as refused:
                self._refusals.add(refused)
        return None

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
            raise messages.RefusedError(
                messages.Reason.MALFORMED, f"Expected one frame, got {len(frames) - 1} or more"
            )
        route, data = frames[0].bytes, frames[1].bytes
        index = self._connected.get(route)
        if index is None:
            return self._greet(route, data, frames[1])
        session = self.sessions[index]
        own, number, message = messages.decode(data, messages.decoder_of(index, self._index))
        if own != session.number:
            raise messages.RefusedError(messages.Reason.SESSION)
        if isinstance(message, messages.Hello):  # It has asked again before it has read the answer.
            session.tell(messages.Welcome())
            return None
        session.take(number)
        return index, message

    def _greet(self, route: bytes, data: bytes, frame: zmq.Frame) -> Received:
        """Begin the session that a new connection asks for.

        Raises:
            RefusedError: It gets none.
        """
        opening = messages.protocol_of(data)
        if opening is None:
            raise messages.RefusedError(messages.Reason.SESSION)
        number, protocol = opening

        def refuse(reason: messages.Reason, words: str) -> messages.RefusedError:
            self._put((route, messages.encode(number, 0, messages.Refused(words))))
            return messages.RefusedError(reason)

        if protocol != messages.PROTOCOL:
            raise refuse(messages.Reason.VERSION, f"it speaks protocol {messages.PROTOCOL}, not {protocol}")
        _, _, hello = messages.decode(data)
        sender: int = hello.sender
        if sender not in self.sessions:
            raise refuse(messages.Reason.SENDER, "it knows no process of this name")
        if self._keeper is not None and frame.get("User-Id") != self._network.book.key_of(sender):
            raise refuse(messages.Reason.SENDER, "its address book has another key for this name")
        for differs, words in (
            (hello.scenario != self._network.scenario, "it has another scenario"),
            (hello.plan != self._network.plan, "it has another plan"),
            (self._is_there(sender), "another process of this name is connected"),
        ):
            if differs:
                raise refuse(messages.Reason.SESSION, words)
        self._connected[route], self._routes[sender] = sender, route
        self.sessions[sender].begin(number, is_open=True)
        self.sessions[sender].tell(messages.Welcome())
        return sender, hello

    def _is_there(self, index: int) -> bool:
        """Whether the connection of a process is there; the library notices within two seconds if not."""
        session = self.sessions[index]
        return session.open and (session.tell(messages.Welcome()) or session.open)

    def _to(self, index: int, data: bytes) -> bool:
        """Send bytes to a process; False where its connection is full, or gone, and the session with it."""
        try:
            return self._put((self._routes[index], data))
        except zmq.ZMQError as error:
            if error.errno != zmq.EHOSTUNREACH:
                raise
            self._connected.pop(self._routes[index], None)
            self.sessions[index].open = False
            return False


class _KnownKeys:
    """Lets only known keys connect, as ZeroMQ's authentication protocol (ZAP) asks for each connection."""

    def __init__(self, keys: Iterable[str | None]) -> None:
        self._keys = {key.encode() for key in keys if key}

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
        trouble: Why there is none, where there is none.
    """

    def __init__(self, network: Network, index: int, server: int, refusals: messages.Refusals) -> None:
        connections = zmq.Event.HANDSHAKE_SUCCEEDED | zmq.Event.DISCONNECTED
        super().__init__(network.keys, refusals, zmq.DEALER, connections)
        self.address, self.trouble = network.book.address_of(server), "nothing answers there"
        self.session = Session(lambda data: self._put((data,)), network.link(index, server))
        self._server, self._decoder = server, messages.decoder_of(server, index)
        self._hello = messages.Hello(messages.PROTOCOL, index, network.scenario, network.plan)
        self._happened = list[zmq.Event]()
        self._restart()
        if (key := network.book.key_of(server)) is not None:
            self._socket.curve_serverkey = key.encode()
        self._socket.connect(self.address)

    def _restart(self) -> None:
        """Ask for another session: the next server may be another process, which does not know this one."""
        self._connected, self._asked = False, -math.inf
        self.session.begin(secrets.randbits(32), is_open=False)

    @property
    def unsettled(self) -> bool:
        """Whether there is something to do even where nothing comes."""
        return bool(self._happened) or not self.session.open

    def poll(self) -> Received | None:
        """Return the server and its message, first the ``Welcome`` of a session; None for nothing."""
        # First events, which count once all messages from before them are read: a goodbye precedes an end.
        self._happened += self._events()
        for frames in self._frames():
            try:
                if (message := self._take(frames)) is not None:
                    return self._server, message
            except messages.RefusedError as refused:
                self._refusals.add(refused)
        for event in self._happened:
            if event & _FAILURES:
                self._refusals.add(messages.RefusedError(messages.Reason.HANDSHAKE))
                self.trouble = "the connection was refused: a key is missing or wrong"
            elif event == zmq.Event.DISCONNECTED:
                self._restart()
            else:
                self._connected = True
        self._happened.clear()
        if self._connected and not self.session.open and time.monotonic() - self._asked >= _AGAIN:
            self._asked = time.monotonic()
            self.session.tell(self._hello)
        return None

    def _take(self, frames: list[zmq.Frame]) -> Any | None:
        """Return a message; None where it says nothing new about the session.

        Raises:
            RefusedError: The message is refused.
        """
        if len(frames) != 1:
            raise messages.RefusedError(messages.Reason.MALFORMED, "Expected one frame, got several")
        own, number, message = messages.decode(frames[0].bytes, self._decoder)
        session, opens = self.session, isinstance(message, messages.Welcome | messages.Refused)
        if own != session.number or not (session.open or opens):
            raise messages.RefusedError(messages.Reason.SESSION)
        if isinstance(message, messages.Refused):
            self.trouble = message.reason
        if isinstance(message, messages.Welcome) and not session.open:
            session.begin(own, is_open=True)
            return message
        if opens:
            return None
        if not isinstance(message, messages.UNNUMBERED):
            session.take(number)
        return message


class Ends:
    """All ends of one process, waited for together: a server, clients, or both.

    Args:
        network: What the process needs to speak with its team.
        index: Its index.

    Attributes:
        sample: Number of the present sample, on which faults of messages depend.
        sessions: Sessions with all processes with which this one speaks, by their indices.
        clients: The ends that connect to others, by their indices.
        refusals: What was refused.
    """

    def __init__(self, network: Network, index: int) -> None:
        self.sample, self._arrived, self.refusals = (
            0,
            deque[Received](),
            messages.Refusals(messages.name_of(index)),
        )
        partners, self._awaits_all = network.partners(index), index == messages.WORLD or network.passes
        self.clients = {k: Client(network, index, k, self.refusals) for k in partners if k > index}
        self.sessions = {k: client.session for k, client in self.clients.items()}
        self._all: list[Server | Client] = [*self.clients.values()]
        if min(partners) < index:
            self._all.append(server := Server(network, index, self.refusals))
            self.sessions |= server.sessions
        self._poller, self._owners = zmq.Poller(), dict[Any, Server | Client]()
        for end in self._all:
            for socket in end.sockets:
                self._poller.register(socket, zmq.POLLIN)
                self._owners[socket] = end

    def send(self, index: int, message: messages.Message) -> bool:
        """Send a message to a process; False where it has no session, does not take it or will not get it."""
        return self.sessions[index].send(message, self.sample)

    def sent(self, index: int) -> int:
        """Return how many messages a process takes in its session, 0 without one."""
        session = self.sessions[index]
        return session.sent if session.open else 0

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
        return {index for index, session in self.sessions.items() if session.open}

    def release(self) -> dict[int, list[Any]]:
        """Send what is late and due, after what is new; return what each process takes of it."""
        return {index: session.release(self.sample) for index, session in self.sessions.items()}

    def open(self, limit: float, ended: Callable[[], Collection[int]] = tuple) -> None:
        """Wait for sessions with all servers, or with all others where this is the world or the team passes.

        Messages that arrive meanwhile are kept for :meth:`receive`.

        Args:
            limit: Longest time to wait [s].
            ended: Returns the processes that are known to have ended, which are not waited for.

        Raises:
            MessagingError: There are none in time; it says who does not answer, where and why.
        """
        deadline = time.monotonic() + limit
        while words := self._missing():
            left = deadline - time.monotonic()
            if gone := ended():
                names = ", ".join(messages.name_of(index) for index in sorted(gone))
                raise MessagingError(f"the process of {names} ended before the start")
            if left <= 0.0:
                raise MessagingError(f"{words} (waited for {limit:g} s)")
            self._poll(min(left, _AGAIN))

    def close(self) -> None:
        """Close all sockets."""
        for end in self._all:
            end.close()

    def _missing(self) -> str:
        """Say with whom there are no sessions yet of those that ``open`` waits for."""
        away = (self.sessions if self._awaits_all else self.clients).keys() - self.present()
        words = [
            f"{messages.name_of(k)} at {self.clients[k].address}: {self.clients[k].trouble}"
            for k in sorted(away & self.clients.keys())
        ]
        silent = ", ".join(messages.name_of(k) for k in sorted(away - self.clients.keys()))
        return "; ".join([*words, *([f"no message came from {silent}"] if silent else [])])

    def _poll(self, seconds: float) -> None:
        """Wait until something comes, then take one message of every end, so that none waits for another."""
        asking = [client for client in self.clients.values() if client.unsettled]
        limit = min(max(seconds, 0.0), _AGAIN if asking else math.inf)
        ready = [self._owners[socket] for socket, _ in self._poller.poll(math.ceil(1e3 * limit))]
        for end in dict.fromkeys((*ready, *asking)):
            if (taken := end.poll()) is not None:
                self._arrived.append(taken)
