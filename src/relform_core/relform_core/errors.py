"""Errors that relform raises on purpose: one line with the object, the value, the bound and the way out."""


class RelformError(Exception):
    """Base of every error that relform raises on purpose; commands print its message and exit with 2."""


class ConfigError(RelformError):
    """A configuration file, or an override of one of its keys, cannot be used."""


class MessageError(RelformError):
    """A received message cannot be used."""


class FlightError(RelformError):
    """A flight cannot start or cannot continue."""


class BagError(RelformError):
    """A bag cannot be written or read."""
