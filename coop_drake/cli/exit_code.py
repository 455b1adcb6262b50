"""What the exit code says."""

from enum import IntEnum

__all__ = ["ExitCode"]


class ExitCode(IntEnum):
    """Exit codes of every command."""

    DONE = 0
    FAILED_RUN = 1
    BAD_INPUT = 2
    INFEASIBLE = 3
    UNDECIDED = 4
    INTERRUPTED = 130
