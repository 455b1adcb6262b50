"""The files that let a team run on several machines: one address book, and a private key for each process."""

from __future__ import annotations

from pathlib import Path

from coop_drake.errors import ScenarioError
from coop_drake.files import write_atomically
from coop_drake.messages.address_book import (
    AddressBook,
    RobotEntry,
    SupervisorEntry,
    WorldEntry,
    dump_address_book,
)
from coop_drake.messages.keys import KeyPair, load_keys, make_keys, save_keys
from coop_drake.messages.schema import MOST_ROBOTS, SUPERVISOR, WORLD
from coop_drake.typed_data import DataError

BOOK = "addresses.yaml"
"""Name of the address book."""


def key_file(index: int) -> str:
    """Return the name of the file with the private key of a process, by its index in messages."""
    return {WORLD: "world.key", SUPERVISOR: "supervisor.key"}.get(index, f"robot_{index}.key")


def make_team_files(folder: Path, robots: int, hosts: tuple[str, str], port: int) -> list[Path]:
    """Draw keys for all processes, and write them and the address book into a folder.

    Args:
        folder: A new or an empty folder.
        robots: Number of robots.
        hosts: Addresses of the machines of the world and of the supervisor.
        port: Where the world listens for measurements; the next one is for efforts, then that of the team.

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
    public = {index: pair.public for index, pair in keys.items()}
    try:
        book = AddressBook(
            WorldEntry(f"tcp://{hosts[0]}:{port}", f"tcp://{hosts[0]}:{port + 1}", public[WORLD]),
            SupervisorEntry(f"tcp://{hosts[1]}:{port + 2}", public[SUPERVISOR]),
            tuple(RobotEntry(public[k]) for k in range(robots)),
        )
    except DataError as error:
        option = "--supervisor and --port" if error.key == "supervisor.team" else "--world and --port"
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
