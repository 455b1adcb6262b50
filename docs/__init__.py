"""The documentation: pages by hand here, and what builds them in `generate`."""
