"""Messages of the sensors and their conversions, one module per sensor; see `wire`."""
