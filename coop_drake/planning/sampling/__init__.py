"""Candidate paths by random trees and elastic bands; they guide the search and prove nothing."""
