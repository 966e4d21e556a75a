"""The nodes: one quadrotor per vehicle, and the clock."""
