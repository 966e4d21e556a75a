"""Flights in one process, metrics, replays, sweeps, plots and reports."""
