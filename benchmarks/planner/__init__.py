"""The planner beside its peers, without its own parts, and on questions of growing size."""
