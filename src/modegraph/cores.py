"""The cores of this machine, shared by everything that works in parallel."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from threading import BoundedSemaphore, Thread
from typing import TypeVar

Result = TypeVar("Result")

COUNT = os.cpu_count() or 1
_FREE = BoundedSemaphore(COUNT)


@contextmanager
def one_core() -> Iterator[None]:
    """Work on one core, as soon as one is free."""
    with _FREE:
        yield


@contextmanager
def single_threaded_algebra() -> Iterator[None]:
    """NumPy's matrix products on the core of their caller, for work that keeps all cores busy by itself.

    Helper threads that wait for the next small product took a third of all processor time.
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        yield


def in_parallel(tasks: Sequence[Callable[[], Result]]) -> Iterator[Result]:
    """Results in order; tasks after the first run on cores that are free, or else when it is their turn.

    A caller that stops early lets what has begun come to its end.
    """
    started: list[Future[Result] | None] = []
    for k, task in enumerate(tasks):
        started.append(_start(task) if k and _FREE.acquire(blocking=False) else None)
    for task, future in zip(tasks, started, strict=True):
        yield task() if future is None else future.result()


def _start(task: Callable[[], Result]) -> Future[Result]:
    future: Future[Result] = Future()

    def work() -> None:
        try:
            future.set_result(task())
        except BaseException as error:  # handed to whoever asks for the result
            future.set_exception(error)
        finally:
            _FREE.release()

    Thread(target=work, name="modegraph-part", daemon=True).start()
    return future
