"""Copies of bags that Foxglove draws in 3D."""
