"""Local processes that run calls; a process that dies loses only its own call."""

import multiprocessing
import signal
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from multiprocessing.connection import Connection
from queue import SimpleQueue
from typing import Any, TypeVar

from relform_core.errors import RelformError

Result = TypeVar("Result")

# A fork would inherit the threads and locks of this process.
_SPAWN = multiprocessing.get_context("spawn")


class LocalProcesses(Executor):
    """An executor of `concurrent.futures` with a process per thread.

    When a process dies, only its call fails, and a new process takes its place; a ProcessPoolExecutor would
    fail all pending calls (docs/decisions/0014-sweep-workers.md).
    """

    def __init__(self, jobs: int) -> None:
        """Run up to ``jobs`` calls at the same time."""
        self._workers = [_Worker() for _ in range(jobs)]
        self._idle: SimpleQueue[_Worker] = SimpleQueue()
        for worker in self._workers:
            self._idle.put(worker)
        self._threads = ThreadPoolExecutor(jobs)

    def submit(self, fn: Callable[..., Result], /, *args: Any, **kwargs: Any) -> Future[Result]:
        """Call a function that does not raise; if the process dies, the future raises RelformError."""
        return self._threads.submit(self._call, fn, args, kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes; ``cancel_futures`` also ends running calls."""
        self._threads.shutdown(wait and not cancel_futures, cancel_futures=cancel_futures)
        for worker in self._workers:
            worker.kill()

    def _call(self, fn: Callable[..., Result], args: Any, kwargs: Any) -> Result:
        worker = self._idle.get()
        try:
            return worker.call(fn, args, kwargs)
        finally:
            self._idle.put(worker)


class _Worker:
    """One process, started when it is first needed, and again after it died."""

    def __init__(self) -> None:
        self._process: multiprocessing.process.BaseProcess | None = None
        self._connection: Connection | None = None

    def call(self, fn: Callable[..., Result], args: Any, kwargs: Any) -> Result:
        if self._process is None or self._connection is None:
            self._connection, theirs = _SPAWN.Pipe()
            self._process = _SPAWN.Process(target=_serve, args=(theirs,), daemon=True)
            self._process.start()
            theirs.close()  # now only the process holds it, so its death closes the connection
        try:
            self._connection.send((fn, args, kwargs))
            result: Result = self._connection.recv()
        except (EOFError, OSError):
            self._process.join()
            exit_code, self._process = self._process.exitcode, None
            raise RelformError(f"the process that flew it {_death(exit_code)}") from None
        return result

    def kill(self) -> None:
        if (process := self._process) is not None:
            process.kill()


def _serve(connection: Connection) -> None:
    """Answer calls until the other end is closed or its process has died."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches all processes; the parent decides
    try:
        while True:
            fn, args, kwargs = connection.recv()
            connection.send(fn(*args, **kwargs))
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return


def _death(exit_code: int | None) -> str:
    if exit_code is not None and exit_code < 0:
        name = signal.Signals(-exit_code).name
        return f"was killed by {name}" + (", perhaps because memory ran out" if name == "SIGKILL" else "")
    return f"ended with exit code {exit_code}"
