"""Sensor models of relform: pure functions of the true state and a random generator."""
