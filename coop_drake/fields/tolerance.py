"""The accuracy that maps are solved to, in a module that scenario files name without loading the solver."""

TOLERANCE = 1e-8
"""Largest estimated error of a map that is accepted, if none is given, in units of the disk's radius [-]."""
