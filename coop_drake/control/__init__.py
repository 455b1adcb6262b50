"""The control laws as pure functions: arrays in, arrays out."""
