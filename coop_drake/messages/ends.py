"""What each process of a team has of the three channels."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from typing import Any, Literal

import zmq

from coop_drake.errors import MessagingError
from coop_drake.messages.address_book import AddressBook
from coop_drake.messages.agreement import ANY_QUESTION, Question, Tap
from coop_drake.messages.client import MessageClient
from coop_drake.messages.codec import prepare_layouts
from coop_drake.messages.keys import KeyPair
from coop_drake.messages.outgoing import SOUND, Links
from coop_drake.messages.refusals import Refusals
from coop_drake.messages.schema import SUPERVISOR, WORLD
from coop_drake.messages.server import MessageServer


def name_of(index: int) -> str:
    """Return the name of a process by its index in messages."""
    return {WORLD: "the world", SUPERVISOR: "the supervisor"}.get(index, f"robot {index}")


class _End:
    """Several sockets of one process, waited for together.

    Attributes:
        servers: Ends that listen.
        clients: Ends that connect.
    """

    def __init__(self, servers: list[MessageServer], clients: list[MessageClient]) -> None:
        prepare_layouts()
        self.servers, self.clients = servers, clients
        self._all: tuple[MessageServer | MessageClient, ...] = (*servers, *clients)
        self._arrived: deque[tuple[int, Any]] = deque()
        self._poller, self._ends = zmq.Poller(), dict[Any, MessageServer | MessageClient]()
        for end in self._all:
            for socket in end.sockets:
                self._poller.register(socket, zmq.POLLIN)
                self._ends[socket] = end

    def receive(self, limit: float = 0.0) -> tuple[int, Any] | None:
        """Return the index of a sender and its message, None where nothing is there in time.

        Messages of one channel come in their order, those of several channels in any.

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

    @property
    def refusals(self) -> Refusals:
        """What was refused on all channels."""
        both = Refusals()
        for end in self._all:
            both.counts.update(end.refusals.counts)
        return both

    def begin(self, sample: int) -> None:
        """Begin a sample by its number: what goes wrong with messages depends on it."""
        for end in self._all:
            end.begin(sample)

    def release(self) -> dict[int, list[Any]]:
        """Send what is late and due, after what is new; return what each process takes of a server's."""
        for client in self.clients:
            client.release()
        due = [server.release() for server in self.servers]
        return {index: [m for each in due for m in each.get(index, ())] for index in due[0]} if due else {}

    def close(self) -> None:
        """Close all sockets."""
        for end in self._all:
            end.close()

    def _poll(self, seconds: float) -> None:
        """Wait until something comes, then take one message of every end, so that none waits for another."""
        asking = [client for client in self.clients if not client.session]
        limit = min([max(seconds, 0.0), *(client.patience for client in asking)])
        ready = [self._ends[socket] for socket, _ in self._poller.poll(math.ceil(1e3 * limit))]
        for end in dict.fromkeys((*ready, *asking)):
            if isinstance(end, MessageServer):
                if (taken := end.receive()) is not None:
                    self._arrived.append(taken)
            elif (message := end.poll()) is not None:
                self._arrived.append((end.server, message))

    def _wait_until(self, done: Callable[[], bool], limit: float, complaint: Callable[[], str]) -> None:
        """Poll until something holds; messages that arrive meanwhile are kept for :meth:`receive`.

        Raises:
            MessagingError: It does not hold in time.
        """
        deadline = time.monotonic() + limit
        while not done():
            left = deadline - time.monotonic()
            self._poll(left)
            if left <= 0.0 and not done():
                raise MessagingError(f"{complaint()} (waited for {limit:g} s)")

    def _open_clients(self, limit: float) -> None:
        def complaint() -> str:
            return "; ".join(
                f"{name_of(client.server)} at {client.address}: {client.trouble}"
                for client in self.clients
                if not client.session
            )

        self._wait_until(lambda: all(client.session for client in self.clients), limit, complaint)


class WorldEnd(_End):
    """The world's ends: it listens on the channels of measurements and of efforts.

    Args:
        book: Who listens where.
        question: What all must agree on.
        keys: The world's keys, None where the book has none.
        links: What goes wrong with messages that it sends.
    """

    def __init__(
        self,
        book: AddressBook,
        question: Question = ANY_QUESTION,
        keys: KeyPair | None = None,
        links: Links = SOUND,
    ) -> None:
        known = {k: book.key_of(k) for k in (*range(len(book.robots)), SUPERVISOR)}
        self.sensors, self.efforts = (
            MessageServer(
                address, known, channel=channel, sender=WORLD, question=question, keys=keys, links=links
            )
            for address, channel in _channels(book)
        )
        super().__init__([self.sensors, self.efforts], [])

    def present(self) -> set[int]:
        """Return the indices of the processes that have a session on both channels."""
        return {
            index
            for index, peer in self.sensors.peers.items()
            if peer.session and self.efforts.peers[index].session
        }

    def open(self, limit: float) -> None:
        """Wait until all robots and the supervisor have sessions.

        Raises:
            MessagingError: Some have none in time; it says who.
        """
        everyone = set(self.sensors.peers)
        self._wait_until(
            lambda: self.present() == everyone, limit, lambda: _missing(everyone - self.present())
        )

    def send(self, peer: int, message: Any) -> bool:
        """Send a message to a robot or the supervisor; False where it has no session or takes no more."""
        return self.sensors.send(peer, message)


class RobotEnd(_End):
    """A robot's ends: it connects to the world on two channels, and to the supervisor on the team's.

    Args:
        book: Who listens where.
        robot: Its index.
        question: What all must agree on.
        keys: Its keys, None where the book has none.
        links: What goes wrong with messages that it sends.
    """

    def __init__(
        self,
        book: AddressBook,
        robot: int,
        question: Question = ANY_QUESTION,
        keys: KeyPair | None = None,
        links: Links = SOUND,
    ) -> None:
        self.sensors, self.efforts = _world_clients(book, robot, question, keys, links)
        self.team = MessageClient(
            book.supervisor.team,
            SUPERVISOR,
            channel="team",
            sender=robot,
            question=question,
            keys=keys,
            server_key=book.supervisor.key,
            links=links,
        )
        super().__init__([], [self.sensors, self.efforts, self.team])

    def open(self, limit: float) -> None:
        """Wait for sessions on all channels.

        Raises:
            MessagingError: There are none in time; it says where and why.
        """
        self._open_clients(limit)


class SupervisorEnd(_End):
    """The supervisor's ends: it connects to the world on two channels, and listens on the team's.

    Args:
        book: Who listens where.
        question: What all must agree on.
        keys: Its keys, None where the book has none.
        tap: Is shown every message of the team's channel.
        links: What goes wrong with messages that it sends.
    """

    def __init__(
        self,
        book: AddressBook,
        question: Question = ANY_QUESTION,
        keys: KeyPair | None = None,
        tap: Tap | None = None,
        links: Links = SOUND,
    ) -> None:
        self.sensors, self.efforts = _world_clients(book, SUPERVISOR, question, keys, links)
        self.team = MessageServer(
            book.supervisor.team,
            {k: robot.key for k, robot in enumerate(book.robots)},
            channel="team",
            sender=SUPERVISOR,
            question=question,
            keys=keys,
            tap=tap,
            links=links,
        )
        super().__init__([self.team], [self.sensors, self.efforts])

    def open(self, limit: float) -> None:
        """Wait for sessions with the world; robots come when they come.

        Raises:
            MessagingError: There are none in time; it says where and why.
        """
        self._open_clients(limit)

    def send_to_all(self, message: Any) -> list[int]:
        """Send a message to every robot that has a session; return those to which it went."""
        return [robot for robot in self.team.peers if self.team.send(robot, message)]


def _channels(book: AddressBook) -> tuple[tuple[str, Literal["sensors", "efforts"]], ...]:
    return (book.world.sensors, "sensors"), (book.world.efforts, "efforts")


def _world_clients(
    book: AddressBook, sender: int, question: Question, keys: KeyPair | None, links: Links
) -> list[MessageClient]:
    return [
        MessageClient(
            address,
            WORLD,
            channel=channel,
            sender=sender,
            question=question,
            keys=keys,
            server_key=book.world.key,
            links=links,
        )
        for address, channel in _channels(book)
    ]


def _missing(indices: set[int]) -> str:
    return "no message came from " + ", ".join(name_of(index) for index in sorted(indices))
