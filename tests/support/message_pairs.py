"""A server and its clients in one process, on a free port of this machine, polled in turn by one thread."""

from __future__ import annotations

import time

import zmq

from coop_drake.messages import MessageClient, MessageServer, Present, Question
from coop_drake.messages.incoming import RATE
from coop_drake.messages.schema import SUPERVISOR

LIMIT = 10.0
"""Longest time that a test waits for what must come [s]."""

QUESTION = Question(1, 2)


class Pairs:
    """A supervisor's server of the team's channel, with honest clients and whatever else a test connects."""

    def __init__(self, robots=2, keys=None, *, rate=RATE, address="tcp://127.0.0.1:*", context=None):
        self.keys, self.shown, self._opened, self._context = keys or {}, [], [], context
        self.server = MessageServer(
            address,
            {k: self.keys[k].public if keys else None for k in range(robots)},
            channel="team",
            sender=SUPERVISOR,
            question=QUESTION,
            keys=self.keys.get(SUPERVISOR),
            context=context,
            tap=lambda *shown: self.shown.append(shown),
            rate=rate,
        )

    def client(self, robot, *, keys=None, server_key=None, question=QUESTION):
        """Return a client that has not asked yet."""
        secured = bool(self.keys)
        client = MessageClient(
            self.server.address,
            SUPERVISOR,
            channel="team",
            sender=robot,
            question=question,
            keys=keys or self.keys.get(robot),
            server_key=server_key or (self.keys[SUPERVISOR].public if secured else None),
            context=self._context,
        )
        self._opened.append(client)
        return client

    def settle(self, done, *clients):
        """Poll all until something holds; return what the server heard meanwhile, without ``Present``."""
        heard, end = [], time.monotonic() + LIMIT
        while not done():
            assert time.monotonic() < end, (str(self.server.refusals), [client.trouble for client in clients])
            for client in clients:
                client.poll()
            if (taken := self.server.receive(0.002)) and not isinstance(taken[1], Present):
                heard.append(taken)
        return heard

    def connect(self, robot, **how):
        """Return a client with a session."""
        client = self.client(robot, **how)
        self.settle(lambda: client.session and self.server.peers[robot].session == client.session, client)
        return client

    def stranger(self):
        """Return a bare socket that is connected to the server."""
        socket = (self._context or zmq.Context.instance()).socket(zmq.DEALER)
        socket.linger = 0
        socket.connect(self.server.address)
        self._opened.append(socket)
        return socket

    def refused(self, count):
        """Poll the server until it has refused so many messages, and return how many of each reason."""
        self.settle(lambda: self.server.refusals.total >= count)
        return {reason.name: number for reason, number in self.server.refusals.counts.items()}

    def close(self):
        """Close all that was opened."""
        for opened in (*self._opened, self.server):
            opened.close()
