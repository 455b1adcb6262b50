"""Who listens where, and who is known by which key, as typed YAML."""

from __future__ import annotations

import re
import socket
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from ipaddress import IPv4Address
from pathlib import Path

from coop_drake.errors import ScenarioError
from coop_drake.messages.keys import PUBLIC_KEY, KeyPair
from coop_drake.messages.schema import MOST_ROBOTS, SUPERVISOR, WORLD
from coop_drake.scenario.document import write
from coop_drake.scenario.reading import read_file
from coop_drake.typed_data import DataError, to_plain

_ADDRESS = re.compile(r"tcp://(\d+\.\d+\.\d+\.\d+):(\d{1,5})")
_ADDRESS_WORDS = "tcp://A.B.C.D:PORT, numbers of a machine that the others reach and a port from 1 to 65535"
_LARGEST_PORT = 65535


@dataclass(frozen=True)
class WorldEntry:
    """The simulated world, or what stands for it.

    Attributes:
        sensors: Where it listens on the channel of the robots' measurements.
        efforts: Where it listens on the channel of their efforts.
        key: Its public key.
    """

    sensors: str
    efforts: str
    key: str | None = None


@dataclass(frozen=True)
class SupervisorEntry:
    """The supervisor: the cell planner, and what holds the team.

    Attributes:
        team: Where it listens on the team's channel.
        key: Its public key.
    """

    team: str
    key: str | None = None


@dataclass(frozen=True)
class RobotEntry:
    """A robot; it listens nowhere.

    Attributes:
        key: Its public key.
    """

    key: str | None = None


@dataclass(frozen=True)
class AddressBook:
    """All processes of a team; the same file on all machines.

    Attributes:
        world: The world.
        supervisor: The supervisor.
        robots: The robots in their order in the scenario.

    Raises:
        DataError: An address or key is none, two addresses are the same, some processes have keys and others
            do not, or an address is not loopback and there are no keys.
    """

    world: WorldEntry
    supervisor: SupervisorEntry
    robots: tuple[RobotEntry, ...]

    def __post_init__(self) -> None:
        if not 1 <= len(self.robots) <= MOST_ROBOTS:
            raise DataError("robots", len(self.robots), f"a list of 1 to {MOST_ROBOTS}")
        seen: set[str] = set()
        outside = [name for name, address in self._addresses() if not _host(name, address).is_loopback]
        for name, address in self._addresses():
            if address in seen:
                raise DataError(name, address, "an address of its own")
            seen.add(address)
        keys = dict(self._keys())
        for name, key in keys.items():
            if key is not None and not PUBLIC_KEY.fullmatch(key):
                raise DataError(
                    name, key, "a public key of 40 characters, as coop-drake apart keys prints it"
                )
            if key is None and outside:
                raise DataError(name, key, f"a public key: {outside[0]} is no address of this machine alone")
            if key is None and any(keys.values()):
                raise DataError(name, key, "a public key, because others have one")
        known = [key for key in keys.values() if key]
        if len(set(known)) < len(known):
            raise DataError("key", max(known, key=known.count), "a key of its own for each process")

    @property
    def secured(self) -> bool:
        """Whether processes prove who they are, and encrypt."""
        return self.world.key is not None

    def key_of(self, index: int) -> str | None:
        """Return the public key of a process by its index in messages."""
        if index in (WORLD, SUPERVISOR):
            return (self.world if index == WORLD else self.supervisor).key
        return self.robots[index].key

    def _addresses(self) -> Iterator[tuple[str, str]]:
        yield "world.sensors", self.world.sensors
        yield "world.efforts", self.world.efforts
        yield "supervisor.team", self.supervisor.team

    def _keys(self) -> Iterator[tuple[str, str | None]]:
        yield "world.key", self.world.key
        yield "supervisor.key", self.supervisor.key
        for k, robot in enumerate(self.robots):
            yield f"robots[{k}].key", robot.key


def _host(name: str, address: str) -> IPv4Address:
    """Return the machine of an address.

    Raises:
        DataError: It is no address.
    """
    parts = _ADDRESS.fullmatch(address)
    try:
        host = IPv4Address(parts[1]) if parts and 0 < int(parts[2]) <= _LARGEST_PORT else None
    except ValueError:
        host = None
    if host is None or host.is_unspecified or host.is_multicast:
        raise DataError(name, address, _ADDRESS_WORDS)
    return host


def load_address_book(path: Path, robots: int) -> AddressBook:
    """Read an address book.

    Args:
        path: The file.
        robots: Number of robots of the team.

    Raises:
        ScenarioError: The file is wrong, or is for another number of robots.
    """
    book = read_file(AddressBook, path)
    if len(book.robots) != robots:
        raise ScenarioError(str(path), "robots", len(book.robots), f"a list of {robots}, as in the scenario")
    return book


def dump_address_book(book: AddressBook) -> str:
    """Write an address book as YAML text."""
    plain = to_plain(book, AddressBook)
    return write(plain)


def local_book(robots: int, keys: dict[int, KeyPair] | None = None) -> AddressBook:
    """Return a book for processes on this machine, with free ports of its loopback interface.

    Args:
        robots: Number of robots.
        keys: Keys of all processes by their index in messages, None for none.
    """
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(3)]
        for each in sockets:
            each.bind(("127.0.0.1", 0))
        addresses = [f"tcp://127.0.0.1:{each.getsockname()[1]}" for each in sockets]
    public = {index: pair.public for index, pair in (keys or {}).items()}
    return AddressBook(
        WorldEntry(addresses[0], addresses[1], public.get(WORLD)),
        SupervisorEntry(addresses[2], public.get(SUPERVISOR)),
        tuple(RobotEntry(public.get(k)) for k in range(robots)),
    )
