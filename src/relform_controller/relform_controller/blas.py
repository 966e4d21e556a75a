"""Matrix products in one thread."""

from contextlib import AbstractContextManager

from threadpoolctl import threadpool_limits


def one_blas_thread() -> AbstractContextManager[object]:
    """A block in which BLAS uses one thread, so that a flight gives the same digits everywhere.

    Products in several threads differ in the last digits, and small ones are slower. Every process that
    runs the controller uses this: the node, flights in one process, and replays.
    """
    limits: AbstractContextManager[object] = threadpool_limits(limits=1, user_api="blas")
    return limits
