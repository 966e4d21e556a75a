"""Export of a path from a bag."""
