"""How a command fails."""


class CommandError(RuntimeError):
    """What went wrong, in one line: it goes to stderr, and the command exits with 1."""


def yaml_problem(error: Exception) -> str:
    """What the parser complains of, in one line."""
    mark, problem = getattr(error, "problem_mark", None), getattr(error, "problem", None) or "cannot be read"
    return f"{problem} at line {mark.line + 1}, column {mark.column + 1}" if mark else problem
