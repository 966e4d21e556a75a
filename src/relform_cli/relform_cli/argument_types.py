"""Types of numbers on the command line, with their bounds."""

import math
from argparse import ArgumentTypeError


def positive_float(text: str) -> float:
    value = float(text)
    if not 0.0 < value < math.inf:
        raise ArgumentTypeError(f"{text} must be above 0 and finite")
    return value


def non_negative_float(text: str) -> float:
    value = float(text)
    if not 0.0 <= value < math.inf:
        raise ArgumentTypeError(f"{text} must be finite and not below 0")
    return value


def positive_int(text: str) -> int:
    value = non_negative_int(text)
    if value == 0:
        raise ArgumentTypeError(f"{text} must be above 0")
    return value


def non_negative_int(text: str) -> int:
    value = int(text)
    if value < 0:
        raise ArgumentTypeError(f"{text} must not be below 0")
    return value
