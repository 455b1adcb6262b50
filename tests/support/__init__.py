"""Builders and oracles that several rooms of the tests share."""
