"""Centralised formation NMPC with real-time iteration, and the node that runs it."""
