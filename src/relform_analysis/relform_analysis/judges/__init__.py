"""Judges of the team estimator that do not share its algorithm: a bound, and a smoother of whole windows."""
