"""Benchmarks: what exists now, measured on this machine, as ratios to a peer measured in the same run."""
