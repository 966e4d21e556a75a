"""Centralised formation NMPC with real-time iteration, and the leader node that runs it."""
