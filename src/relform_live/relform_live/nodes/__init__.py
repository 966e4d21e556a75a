"""The node that reads a running flight."""
