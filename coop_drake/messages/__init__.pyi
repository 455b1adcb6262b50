from .address_book import AddressBook, dump_address_book, load_address_book, local_book
from .agreement import Question
from .client import MessageClient
from .ends import RobotEnd, SupervisorEnd, WorldEnd, name_of
from .keys import KeyPair, load_keys, make_keys, save_keys
from .refusals import Reason, Refusals
from .schema import (
    SUPERVISOR,
    WORLD,
    Effort,
    Goodbye,
    Hello,
    Hold,
    HoldRequest,
    Present,
    Ready,
    Sample,
    Status,
    Switch,
    Telemetry,
    Tick,
    TurnedAway,
    Welcome,
)
from .server import MessageServer
from .team_files import load_own_keys, make_team_files

__all__ = [
    "SUPERVISOR",
    "WORLD",
    "AddressBook",
    "Effort",
    "Goodbye",
    "Hello",
    "Hold",
    "HoldRequest",
    "KeyPair",
    "MessageClient",
    "MessageServer",
    "Present",
    "Question",
    "Ready",
    "Reason",
    "Refusals",
    "RobotEnd",
    "Sample",
    "Status",
    "SupervisorEnd",
    "Switch",
    "Telemetry",
    "Tick",
    "TurnedAway",
    "Welcome",
    "WorldEnd",
    "dump_address_book",
    "load_address_book",
    "load_keys",
    "load_own_keys",
    "local_book",
    "make_keys",
    "make_team_files",
    "name_of",
    "save_keys",
]
