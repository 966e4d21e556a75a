"""The node that runs the controller."""
