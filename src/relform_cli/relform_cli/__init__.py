"""A ``ros2`` command for environments that have none: verbs, output and exit codes of ros2cli 0.32.

Each module ``<name>_command`` is one command; other packages add theirs by entry points, see ``commands``.
"""
