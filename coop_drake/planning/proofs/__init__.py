"""Proofs that no plan exists, for the whole team, for parts of it and for an inscribed disc."""
