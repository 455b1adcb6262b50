"""Robots, supervisor and world as processes, and the messages between them; needs the extra `apart`."""

from coop_drake.lazy import lazy_names

REJOIN = 60.0
"""How long a team at rest waits for a process that is missing [s]: time to start it again by hand."""

RESTARTS = 3
"""How often a process that ended too early is started again [-]: enough for accidents, and an error that
comes back each time ends the run soon."""

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
