"""The exit codes of every command."""

from enum import IntEnum


class ExitCode(IntEnum):
    """What a command tells the shell that called it."""

    DONE = 0
    FAILED_RUN = 1
    BAD_INPUT = 2
    INFEASIBLE = 3
    UNDECIDED = 4
    INTERRUPTED = 130
