"""Simulated quadrotors, one node per vehicle, and the clock that steps them."""
