"""Conversion of each sensor's measurement, one module per sensor, called by its name; see `wire`."""
