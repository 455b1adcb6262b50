"""Questions derived from the one that was asked: with a margin, with fewer robots, in another unit."""
