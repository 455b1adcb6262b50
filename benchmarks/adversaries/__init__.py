"""Altered plans and proofs, the truth of each decided here, beside what the exact checker says of them."""
