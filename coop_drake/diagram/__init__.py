"""Wiring: one robot's controller, the transport station, the closed loop."""
