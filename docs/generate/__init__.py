"""Builds the documentation: pages by hand, pages made from the code, all of it checked."""
