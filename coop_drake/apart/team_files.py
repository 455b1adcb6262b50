"""The files of a team: who listens where and is known by which key, and a private key for each process."""

from __future__ import annotations

import os
import re
import socket
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from ipaddress import IPv4Address
from pathlib import Path

import zmq
import zmq.auth

from coop_drake.apart.messages import MOST_ROBOTS, SUPERVISOR, WORLD
from coop_drake.errors import ScenarioError
from coop_drake.files import check_readable, write_atomically
from coop_drake.scenario.document import read_file, write
from coop_drake.typed_data import DataError, to_plain

_ADDRESS = re.compile(r"tcp://(\d+\.\d+\.\d+\.\d+):(\d{1,5})")
_ADDRESS_WORDS = "tcp://A.B.C.D:PORT, numbers of a machine that the others reach and a port from 1 to 65535"
_LARGEST_PORT = 65535

PUBLIC_KEY = re.compile(r"[0-9A-Za-z.\-:+=^!/*?&<>()\[\]{}@%$#]{40}")
"""A key of CURVE: 32 bytes in the text form Z85."""

_LARGEST = 0.01
"""Largest file of a key [MB]."""

_OTHERS = 0o077
"""Permissions of everyone but the owner."""

BOOK = "addresses.yaml"
"""Name of the address book."""


@dataclass(frozen=True)
class KeyPair:
    """The keys of one process, each as text of 40 characters.

    Attributes:
        public: What others know it by; it stands in the address book.
        private: What it proves that by; it never leaves its file and this process, and is never shown.
    """

    public: str
    private: str = field(repr=False)


def make_keys() -> KeyPair:
    """Draw new keys."""
    public, private = zmq.curve_keypair()
    return KeyPair(public.decode(), private.decode())


def save_keys(path: Path, keys: KeyPair) -> None:
    """Write keys into a new file that nobody but its owner may read.

    Raises:
        OSError: The file exists, or cannot be written.
    """
    text = f'metadata\ncurve\n    public-key = "{keys.public}"\n    secret-key = "{keys.private}"\n'
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
        file.write(text)


def load_keys(path: Path) -> KeyPair:
    """Read the keys of a process.

    Raises:
        ScenarioError: The file cannot be read, others may read it, or it holds no pair of keys.
    """
    try:
        mode = check_readable(path, _LARGEST).stat().st_mode
        if mode & _OTHERS:
            allowed = f"a file for its owner alone; run: chmod 600 {path}"
            raise ScenarioError(str(path), "permissions", f"{mode & 0o777:o}", allowed)
        public, private = zmq.auth.load_certificate(path)
        pair = KeyPair(public.decode(), (private or b"").decode())
        fits = PUBLIC_KEY.fullmatch(pair.private) and zmq.curve_public(pair.private.encode()) == public
    except (OSError, ValueError) as error:
        raise ScenarioError(str(path), "the file", str(error), "a file of coop-drake apart keys") from error
    if not fits:
        raise ScenarioError(
            str(path), "secret-key", "this text", "the private key that belongs to the public one"
        )
    return pair


@dataclass(frozen=True)
class Listener:
    """The world, to which all others connect, or the supervisor, to which robots do.

    Attributes:
        address: Where it listens.
        key: Its public key.
    """

    address: str
    key: str | None = None


@dataclass(frozen=True)
class RobotEntry:
    """A robot.

    Attributes:
        key: Its public key.
        address: Where it listens to the robots before it, which only those of a team that passes do.
    """

    key: str | None = None
    address: str | None = None


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

    world: Listener
    supervisor: Listener
    robots: tuple[RobotEntry, ...]

    def __post_init__(self) -> None:
        if not 1 <= len(self.robots) <= MOST_ROBOTS:
            raise DataError("robots", len(self.robots), f"a list of 1 to {MOST_ROBOTS}")
        listeners = {"world": self.world, "supervisor": self.supervisor}
        addresses = {f"{name}.address": one.address for name, one in listeners.items()}
        for k, entry in enumerate(self.robots):
            if entry.address is not None:
                addresses[f"robots[{k}].address"] = entry.address
        outside = [name for name, address in addresses.items() if not _host(name, address).is_loopback]
        for i, (name, address) in enumerate(addresses.items()):
            if address in [*addresses.values()][:i]:
                raise DataError(name, address, "an address of its own")
        robots = {f"robots[{k}]": robot for k, robot in enumerate(self.robots)}
        keys = {f"{name}.key": one.key for name, one in (listeners | robots).items()}
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

    def address_of(self, index: int) -> str:
        """Return where a process listens, by its index in messages.

        Raises:
            ScenarioError: The book does not say.
        """
        address = self._entry(index).address
        if address is None:
            allowed = (
                "an address such as tcp://127.0.0.1:7002: robots of a team that passes speak to each other"
            )
            raise ScenarioError("the address book", f"robots[{index}].address", None, allowed)
        return address

    def _entry(self, index: int) -> Listener | RobotEntry:
        return {WORLD: self.world, SUPERVISOR: self.supervisor}.get(index) or self.robots[index]

    @property
    def secured(self) -> bool:
        """Whether processes prove who they are, and encrypt."""
        return self.world.key is not None

    def key_of(self, index: int) -> str | None:
        """Return the public key of a process by its index in messages."""
        return self._entry(index).key


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
    return write(to_plain(book, AddressBook))


def local_book(robots: int, keys: dict[int, KeyPair] | None = None) -> AddressBook:
    """Return a book for processes on this machine, with free ports of its loopback interface.

    Args:
        robots: Number of robots.
        keys: Keys of all processes by their index in messages, None for none.
    """
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(2 + robots)]
        for each in sockets:
            each.bind(("127.0.0.1", 0))
        addresses = [f"tcp://127.0.0.1:{each.getsockname()[1]}" for each in sockets]
    return _book(addresses, robots, keys or {})


def _book(addresses: Sequence[str], robots: int, keys: Mapping[int, KeyPair]) -> AddressBook:
    """Return the book by the addresses of world, supervisor and maybe robots, and the keys of all."""
    public = {index: pair.public for index, pair in keys.items()}
    world, supervisor = (Listener(addresses[i], public.get(k)) for i, k in enumerate((WORLD, SUPERVISOR)))
    own = [*addresses[2:], *[None] * robots]
    return AddressBook(world, supervisor, tuple(RobotEntry(public.get(k), own[k]) for k in range(robots)))


def key_file(index: int) -> str:
    """Return the name of the file with the private key of a process, by its index in messages."""
    return {WORLD: "world.key", SUPERVISOR: "supervisor.key"}.get(index, f"robot_{index}.key")


def make_team_files(folder: Path, robots: int, hosts: tuple[str, str], port: int) -> list[Path]:
    """Draw keys for all processes, and write them and the address book into a folder.

    Args:
        folder: A new or an empty folder.
        robots: Number of robots.
        hosts: Addresses of the machines of the world and of the supervisor.
        port: Where the world listens; the supervisor listens at the next one, and where all are on this
            machine robots at those after it.

    Returns:
        The address book, then the private keys.

    Raises:
        DataError: An address, the port, or the number of robots is not allowed; with the option's name.
        ScenarioError: There are files in the folder.
        OSError: The folder cannot be written.
    """
    if not 1 <= robots <= MOST_ROBOTS:
        raise DataError("--robots", robots, f"a whole number from 1 to {MOST_ROBOTS}")
    keys = {index: make_keys() for index in (WORLD, SUPERVISOR, *range(robots))}
    try:
        alone = set(hosts) == {"127.0.0.1"}
        listening = [*hosts, *(hosts[:1] * robots if alone else ())]
        book = _book([f"tcp://{host}:{port + k}" for k, host in enumerate(listening)], robots, keys)
    except DataError as error:
        option = "--supervisor and --port" if error.key == "supervisor.address" else "--world and --port"
        raise DataError(option, error.value, error.allowed) from error
    if folder.is_dir() and any(folder.iterdir()):
        raise ScenarioError(str(folder), "--out", str(folder), "a new or an empty folder")
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    for index, pair in keys.items():
        save_keys(folder / key_file(index), pair)
    write_atomically(folder / BOOK, dump_address_book(book).encode())
    return [folder / BOOK, *(folder / key_file(index) for index in keys)]


def load_own_keys(book: AddressBook, index: int, path: Path | None) -> KeyPair | None:
    """Read the private key of a process; None where the address book has no keys.

    Args:
        book: The address book.
        index: Index of the process in messages.
        path: The file, None where none was named.

    Raises:
        ScenarioError: There is none where one is needed, or it is not the one that the book names.
    """
    if not book.secured:
        return None
    if path is None:
        raise ScenarioError("the address book", "keys", None, f"--key FILE, as {key_file(index)}")
    pair = load_keys(path)
    if pair.public != book.key_of(index):
        allowed = f"the key that the address book has for this process, as in {key_file(index)}"
        raise ScenarioError(str(path), "public-key", pair.public, allowed)
    return pair
