"""Bags, metrics, figures and in-process runs of relform."""
