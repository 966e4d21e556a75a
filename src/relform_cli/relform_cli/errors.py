"""Errors of commands."""


class CommandError(RuntimeError):
    """One line for stderr; the command exits with 1."""


def yaml_problem(error: Exception) -> str:
    """The error of the YAML parser in one line."""
    mark, problem = getattr(error, "problem_mark", None), getattr(error, "problem", None) or "cannot be read"
    return f"{problem} at line {mark.line + 1}, column {mark.column + 1}" if mark else problem
