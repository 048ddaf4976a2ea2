"""The cores of this machine, shared by everything that works in parallel."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from threading import BoundedSemaphore, Lock, Thread, local
from typing import Any, Generic, TypeVar

Result = TypeVar("Result")

COUNT = os.cpu_count() or 1
_FREE = BoundedSemaphore(COUNT)
_LOCK = Lock()
_WAITING: deque[_Task[Any]] = deque()
"""Tasks that nobody has begun, the oldest first: a core that gets free takes one."""
_HOLDER = local()
"""``on_core``: whether this thread works on a core it has taken."""


@contextmanager
def one_core() -> Iterator[None]:
    """Work on one core, as soon as one is free."""
    _FREE.acquire()
    _HOLDER.on_core = True
    try:
        yield
    finally:
        _HOLDER.on_core = False
        _give_back()


@contextmanager
def single_threaded_algebra() -> Iterator[None]:
    """NumPy's matrix products on the core of their caller, for work that keeps all cores busy by itself.

    Helper threads that wait for the next small product took a third of all processor time.
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        yield


class _Task(Generic[Result]):
    """Something to do, by its owner or on a core that is free."""

    def __init__(self, work: Callable[[], Result]) -> None:
        self.work = work
        self.future: Future[Result] = Future()

    def run(self) -> None:
        try:
            self.future.set_result(self.work())
        except BaseException as error:  # handed to whoever asks for the result
            self.future.set_exception(error)


def in_parallel(tasks: Sequence[Callable[[], Result]]) -> Iterator[Result]:
    """Results in order; tasks after the first run on cores that are or get free, or else when it is their turn.

    A caller that stops early lets what has begun come to its end.
    """
    first, later = tasks[:1], [_Task(work) for work in tasks[1:]]
    with _LOCK:
        for task in later:
            if _FREE.acquire(blocking=False):
                _start(task)
            else:
                _WAITING.append(task)
    try:
        for work in first:
            yield work()
        for task in later:
            if _withdrawn(task):
                task.run()
            yield _result(task)
    finally:
        for task in later:
            _withdrawn(task)


def _result(task: _Task[Result]) -> Result:
    """The result of a task; while others work on it, the core of this thread is free for other work."""
    if not task.future.done() and getattr(_HOLDER, "on_core", False):
        _give_back()
        try:
            return task.future.result()
        finally:
            _FREE.acquire()
    return task.future.result()


def _withdrawn(task: _Task[Any]) -> bool:
    """Take a task back that nobody has begun."""
    with _LOCK:
        try:
            _WAITING.remove(task)
        except ValueError:
            return False
    return True


def _start(task: _Task[Any]) -> None:
    """Run a task on a core that is taken already, and give that back."""

    def work() -> None:
        _HOLDER.on_core = True
        task.run()
        _give_back()

    Thread(target=work, name="modegraph-part", daemon=True).start()


def _give_back() -> None:
    """A core is free: for the oldest task that waits, or for anyone."""
    with _LOCK:
        if _WAITING:
            _start(_WAITING.popleft())
        else:
            _FREE.release()
