"""States of a robot's process, and by what a team that is not complete goes on."""

from __future__ import annotations

FOLLOWS, HOLDS, STANDS, ASKS, OUTSIDE = range(5)
"""States of a robot, see ``messages.Effort``."""

STATES = (
    "follows the plan",
    "holds",
    "waits at rest to begin its cell anew",
    "does not know the current cell",
    "rests where it cannot begin its cell anew",
)
"""The same in words."""

AGAIN = 0.1
"""Time after which a message that has had no effect yet is sent again [s]: long for a message and its answer,
short beside the time in which a team comes to rest."""

REPORT_AGAIN = 0.01
"""Time after which a report that has had no effect yet is sent again [s]. A robot that has not heard of a new
cell answers with one of the cell before; in shipped transports funnels bear this delay more than once."""

AHEAD = 0.1
"""Time between the order to begin and the sample at which all robots begin [s]: every robot must have heard
it by then. While one has not, the drives brake on, and the order is given again."""

REJOIN = 60.0
"""How long a team at rest waits for a process that is missing [s]: time to start it again by hand."""

RESTARTS = 3
"""How often a process that ended too early is started again [-]: enough for accidents, and an error that
comes back each time ends the run soon."""
