"""From measurements to the state of the team."""
