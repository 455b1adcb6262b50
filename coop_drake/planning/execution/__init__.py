"""From a channel of free boxes to a plan that controllers can follow."""
