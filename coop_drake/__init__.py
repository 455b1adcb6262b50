"""Cooperative transport by mobile manipulators: certified plans, harmonic fields and decentralised control in Drake."""
