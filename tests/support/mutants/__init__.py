"""Malformed files by mutation of sound ones; every kind says why what it makes is malformed."""
