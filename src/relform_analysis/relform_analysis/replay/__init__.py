"""Recorded measurements fed to a controller again."""
