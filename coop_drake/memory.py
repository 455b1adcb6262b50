"""How much memory this process and those that it waited for took."""

from __future__ import annotations

import resource
import sys
from pathlib import Path

__all__ = ["peak_memory_mb"]

_STATUS = Path("/proc/self/status")
_UNIT = 1e-6 if sys.platform == "darwin" else 1.024e-3  # Bytes there, kibibytes here.


def peak_memory_mb() -> float:
    """Return the largest resident memory of this process or of one that it waited for, so far [MB].

    Where the kernel keeps it for the program alone that is read: the figure of ``getrusage`` begins with
    what the parent held when it started this process.
    """
    children = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * _UNIT
    if _STATUS.exists():
        fields = dict(line.split(":", 1) for line in _STATUS.read_text().splitlines())
        if "VmHWM" in fields:
            return max(children, int(fields["VmHWM"].split()[0]) * _UNIT)
    return max(children, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * _UNIT)
