"""Starts and supervises the nodes of a flight."""
