"""Flights side by side: what differs in their configurations, and what differs in their results."""
