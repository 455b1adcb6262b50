"""Run a scenario: the simulation, its log, and the invariants checked while it runs."""
