"""The command line: one command for each step from scenario to recording, for people and for machines."""

from coop_drake.cli.app import app, main

__all__ = ["app", "main"]
