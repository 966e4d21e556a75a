"""The dense solver: condensed QP with bounds."""
