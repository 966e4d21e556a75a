"""Errors that relform raises on purpose: one line with the object, the value, the bound, the way out."""


class RelformError(Exception):
    """Base of every error that relform raises on purpose; scripts print its message and exit non-zero."""


class ConfigError(RelformError):
    """A configuration file, or an override of one of its keys, cannot be used."""


class MessageError(RelformError):
    """A message that came over the wire cannot be used."""


class FlightError(RelformError):
    """A flight cannot start or cannot go on."""


class BagError(RelformError):
    """A bag cannot be written or read."""
