"""The cores of this machine, shared by everything that works in parallel."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from threading import Condition, Lock, Thread, local
from typing import Any, Generic, TypeVar

Result = TypeVar("Result")

COUNT = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
"""Cores that this process may use."""


class Cores:
    """So many cores, the work on them, and the tasks that wait for one.

    Nothing that the garbage collector may run (the end of an abandoned generator) takes a lock: it may come at
    any instant, also to a thread that holds that very lock.
    """

    def __init__(self, count: int) -> None:
        self.free = count
        self._changed = Condition()
        self._waiting: deque[_Task[Any]] = deque()
        """Tasks that nobody had begun when they came here, the oldest first: a core that gets free takes one."""
        self._thread = local()
        """``at_work``: whether this thread has a core."""

    @contextmanager
    def one(self) -> Iterator[None]:
        """Work on one core, as soon as one is free; a thread that has one keeps that."""
        if self._at_work():
            yield
            return
        self._take()
        try:
            yield
        finally:
            self._give_back()

    def in_parallel(self, tasks: Sequence[Callable[[], Result]]) -> Iterator[Result]:
        """Results in order; tasks after the first run on cores that are or get free, or else when it is their turn.

        A caller that stops early lets what has begun come to its end.
        """
        first, later = tasks[:1], [_Task(work) for work in tasks[1:]]
        for task in later:
            self._offer(task)
        try:
            for work in first:
                yield work()
            for task in later:
                if task.claim():
                    task.run()
                yield self._result(task)
        finally:
            for task in later:
                task.claim()

    def _at_work(self) -> bool:
        return getattr(self._thread, "at_work", False)

    def _take(self) -> None:
        with self._changed:
            while not self.free:
                self._changed.wait()
            self.free -= 1
        self._thread.at_work = True

    def _give_back(self) -> None:
        """A core is free: for the oldest task that waits, or for anyone."""
        self._thread.at_work = False
        with self._changed:
            task = self._next()
            if task is None:
                self.free += 1
                self._changed.notify()
        if task is not None:
            self._start(task)

    def _next(self) -> _Task[Any] | None:
        """The oldest task that nobody has begun, claimed."""
        while self._waiting:
            task = self._waiting.popleft()
            if task.claim():
                return task
        return None

    def _offer(self, task: _Task[Any]) -> None:
        """Begin a task on a core that is free, or let it wait for one."""
        with self._changed:
            if not self.free:
                self._waiting.append(task)
                return
            self.free -= 1
        task.claim()
        self._start(task)

    def _start(self, task: _Task[Any]) -> None:
        """Run a claimed task on a core that is taken for it, and give that back before its result is known."""

        def work() -> None:
            self._thread.at_work = True
            task.run(done=self._give_back)

        Thread(target=work, name="modegraph-part", daemon=True).start()

    def _result(self, task: _Task[Result]) -> Result:
        """The result of a task; while others work on it, the core of this thread is free for other work."""
        if not task.future.done() and self._at_work():
            self._give_back()
            try:
                return task.future.result()
            finally:
                self._take()
        return task.future.result()


class _Task(Generic[Result]):
    """Something to do, once, by whoever claims it first: its owner, or a core that is free."""

    def __init__(self, work: Callable[[], Result]) -> None:
        self.work = work
        self.future: Future[Result] = Future()
        self._claimed = Lock()

    def claim(self) -> bool:
        """Whether the caller is the first who wants this task (or wants it not to be done)."""
        return self._claimed.acquire(blocking=False)

    def run(self, done: Callable[[], None] = lambda: None) -> None:
        """Work, say that it is done, and hand the result (or the error) to whoever asks for it."""
        try:
            try:
                result = self.work()
            finally:
                done()
        except BaseException as error:
            self.future.set_exception(error)
        else:
            self.future.set_result(result)


@contextmanager
def single_threaded_algebra() -> Iterator[None]:
    """NumPy's matrix products on the core of their caller, for work that keeps all cores busy by itself.

    Helper threads that wait for the next small product took a third of all processor time.
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        yield


_MACHINE = Cores(COUNT)
one_core = _MACHINE.one
in_parallel = _MACHINE.in_parallel
