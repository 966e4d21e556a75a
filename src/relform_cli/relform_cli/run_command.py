"""Run an executable of a package."""

import shlex
import signal
import subprocess
from argparse import REMAINDER, ArgumentParser, Namespace
from pathlib import Path

from relform_cli.completion import completed_by
from relform_cli.errors import CommandError
from relform_cli.packages import complete_executable, complete_package, executables


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("--prefix", help="command to put before the executable, such as 'gdb -ex run --args'")
    completed_by(complete_package, parser.add_argument("package_name"))
    completed_by(complete_executable, parser.add_argument("executable_name"))
    parser.add_argument("argv", nargs=REMAINDER, help="arguments of the executable")
    parser.set_defaults(run=run)


def run(arguments: Namespace) -> int:
    try:
        prefix = shlex.split(arguments.prefix or "")
    except ValueError as error:
        raise CommandError(f"--prefix {arguments.prefix}: {error}") from None
    command = [*prefix, str(find(arguments.package_name, arguments.executable_name))]
    try:
        process = subprocess.Popen([*command, *arguments.argv])
    except OSError as error:
        raise CommandError(f"{command[0]} cannot be run: {error.strerror}") from None
    signal.signal(signal.SIGTERM, lambda *_: process.terminate())
    code = wait(process)
    if code < 0:
        print("[ros2run]:", signal.strsignal(-code))
    elif code > 0:
        print("[ros2run]: Process exited with failure", code)
    return code


def find(package: str, name: str) -> Path:
    """The executable with a name.

    Raises:
        CommandError: no executable has the name, or several have it.
    """
    paths = [path for path in executables(package) if path.name == name]
    if not paths:
        raise CommandError("No executable found")
    if len(paths) > 1:
        raise CommandError("\n- ".join(["Multiple executables found:", *map(str, paths)]))
    return paths[0]


def wait(process: subprocess.Popen[bytes]) -> int:
    """Wait until the process ends and return its exit code; Ctrl-C reaches the process from the terminal."""
    while True:
        try:
            return process.wait()
        except KeyboardInterrupt:
            pass
