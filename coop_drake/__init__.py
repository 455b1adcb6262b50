"""Cooperative transport by mobile manipulators: certified plans, harmonic fields, decentralised control."""
