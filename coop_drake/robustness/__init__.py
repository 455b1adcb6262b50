"""Bounds of what departs under a budget, for the planner, which chooses, and the verifier, which checks.

Sets of states are boxes and tubes, the map is that of a sampled double integrator behind a lag, disturbances
are bounded numbers. Only ``funnel_law`` knows the law of the axes.
"""
