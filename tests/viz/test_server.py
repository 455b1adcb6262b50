"""Meshcat keeps its address to itself, and Drake's logger is as it was."""

from __future__ import annotations

import logging
import socket

import pytest
from pydrake.geometry import Meshcat

from coop_drake.viz.recording import silent_meshcat


@pytest.fixture
def logged():
    records = []

    class Collector(logging.Handler):
        def emit(self, record):
            records.append(record.getMessage())

    logger, collector = logging.getLogger("drake"), Collector()
    level = logger.level
    logger.addHandler(collector)
    logger.setLevel(logging.INFO)
    yield records
    logger.setLevel(level)
    logger.removeHandler(collector)


def test_a_server_that_is_started_says_nothing(logged):
    assert silent_meshcat().web_url().startswith("http://localhost:")
    assert logged == []


def test_only_browsers_on_this_machine_reach_it():
    meshcat = silent_meshcat()
    with socket.create_connection(("127.0.0.1", meshcat.port()), timeout=10.0):
        pass
    # Another address of this machine: a server that listens on all of them would answer.
    with pytest.raises((ConnectionRefusedError, TimeoutError)):
        socket.create_connection(("127.0.0.2", meshcat.port()), timeout=10.0)


def test_others_that_are_started_later_do_so_again(logged):
    silent_meshcat()
    Meshcat()
    assert [line.partition(" at ")[0] for line in logged] == ["Meshcat listening for connections"]
