"""The typed scenario file: dataclasses, loading and validation."""
