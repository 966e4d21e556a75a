"""The mission of a flight: path of the leader, formation, phases and requests."""
