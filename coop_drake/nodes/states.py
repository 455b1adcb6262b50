"""States of a robot's process, and by what a team that is not complete goes on."""

from __future__ import annotations

FOLLOWS, HOLDS, STANDS, ASKS, OUTSIDE, RETURNS, LATE = range(7)
"""States of a robot, see ``messages.Effort``."""

STATES = (
    "follows the plan",
    "holds",
    "waits at rest to begin its cell anew",
    "does not know the current cell",
    "rests where it cannot begin its cell anew",
    "returns slowly to its cell, uncertified",
    "has measurements that are older than the plan allows, or stamps that cannot be",
)
"""The same in words."""

MOVES = (FOLLOWS, HOLDS, RETURNS)
"""States in which a robot gives efforts of its own."""

AGAIN = 0.1
"""Time after which a message that has had no effect yet is sent again [s]: long for a message and its answer,
short beside the time in which a team comes to rest."""

REPORT_TIMEOUT = 0.025
"""Time after which a robot retransmits a report to which no new cell has come [s]: robots of the shipped
``base`` become ready to leave a cell within 20 ms, in one cell within 35 ms, so that a channel without losses
carries each report once. The funnels of shipped transports bear this delay of one robot."""

LOSSY_REPORT_TIMEOUT = 0.01
"""The same once a new cell has come late, because its message or a report was lost [s]."""

LOSSY_COPIES = 3
"""In so many further samples the supervisor sends a new cell, after a robot has missed one [-]: with
a fifth of all messages lost, a robot then misses all of them less than twice in a thousand cells."""

LASTING = 0.3
"""For how long a robot sees rest before it says so [s]: braked teams swing with periods above a second."""

AHEAD = 0.1
"""Time between the order to begin and the sample at which all robots begin [s]: every robot must have heard
it by then. While one has not, the drives brake on, and the order is given again."""

REJOIN = 60.0
"""How long a team at rest waits for a process that is missing [s]: time to start it again by hand."""

RESTARTS = 3
"""How often a process that ended too early is started again [-]: enough for accidents, and an error that
comes back each time ends the run soon."""
