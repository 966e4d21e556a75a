"""The monitor, the node that watches a flight from inside the bring-up process."""
