"""Work shared among the cores."""

import threading
from collections.abc import Callable

import pytest
from threadpoolctl import threadpool_info

from modegraph.cores import Cores, in_parallel, single_threaded_algebra

SOON = 20.0
"""Seconds after which something that waits is taken to wait for ever."""


def ends(work: Callable[[], None]) -> bool:
    """Whether work in another thread comes to its end."""
    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(SOON)
    return not thread.is_alive()


def test_results_come_in_order() -> None:
    assert list(in_parallel([lambda k=k: k * k for k in range(6)])) == [k * k for k in range(6)]


def test_no_tasks_have_no_results() -> None:
    assert list(in_parallel([])) == []


def test_tasks_run_together_where_a_core_is_free() -> None:
    met = threading.Barrier(2, timeout=SOON)
    assert sorted(Cores(1).in_parallel([met.wait, met.wait])) == [0, 1]


def test_without_a_free_core_they_run_one_after_the_other() -> None:
    cores = Cores(1)
    with cores.one():
        names = list(cores.in_parallel([threading.current_thread, threading.current_thread]))
    assert names == [threading.current_thread()] * 2


def test_a_core_that_gets_free_takes_what_waits() -> None:
    cores = Cores(2)
    taken, leave, met = threading.Event(), threading.Event(), threading.Barrier(2, timeout=SOON)

    def other() -> None:
        with cores.one():
            taken.set()
            leave.wait(SOON)

    helper = threading.Thread(target=other)
    with cores.one():
        helper.start()
        assert taken.wait(SOON)

        def first() -> int:
            # The second task waits; the core of the helper takes it, and both meet.
            leave.set()
            return met.wait()

        assert sorted(cores.in_parallel([first, met.wait])) == [0, 1]
    helper.join(SOON)
    assert cores.free == 2


def test_a_thread_that_waits_lends_its_core() -> None:
    cores = Cores(2)
    used = threading.Event()

    def third() -> None:
        with cores.one():
            used.set()

    helper = threading.Thread(target=third)

    def slow() -> bool:
        # Its owner holds the other core, and has nothing to do but wait for this.
        helper.start()
        return used.wait(SOON)

    with cores.one():
        assert list(cores.in_parallel([lambda: True, slow])) == [True, True]
        helper.join(SOON)
        assert cores.free == 1
    assert cores.free == 2


def test_a_thread_that_has_a_core_takes_no_other() -> None:
    cores = Cores(1)

    def twice() -> None:
        with cores.one(), cores.one():
            pass

    assert ends(twice)
    assert cores.free == 1


def test_who_stops_early_leaves_nothing_to_be_begun() -> None:
    cores = Cores(1)
    begun: list[int] = []
    with cores.one():
        results = cores.in_parallel([lambda: begun.append(1), lambda: begun.append(2), lambda: begun.append(3)])
        next(results)
        results.close()  # type: ignore[attr-defined]
    assert begun == [1]
    assert cores.free == 1


def test_the_end_of_abandoned_work_waits_for_no_lock() -> None:
    """The garbage collector may end it in a thread that holds any of them."""
    cores = Cores(1)
    with cores.one():
        results = cores.in_parallel([lambda: 1, lambda: 2])
        next(results)
        with cores._changed:
            assert ends(results.close)  # type: ignore[attr-defined]


def test_an_error_reaches_the_caller_and_gives_the_core_back() -> None:
    cores = Cores(1)

    def fails() -> int:
        raise ValueError("of this task")

    with pytest.raises(ValueError, match="of this task"):
        list(cores.in_parallel([lambda: 1, fails]))
    assert cores.free == 1


def test_many_threads_share_few_cores() -> None:
    """Tasks within tasks, some given up: never more work than cores, and in the end all cores are free."""
    cores = Cores(3)
    lock = threading.Lock()
    working, most = 0, 0

    def leaf() -> int:
        nonlocal working, most
        with lock:
            working += 1
            most = max(most, working)
        sum(range(2000))
        with lock:
            working -= 1
        return 1

    def branch(depth: int) -> int:
        if depth == 0:
            return leaf()
        results = cores.in_parallel([lambda: branch(depth - 1)] * 3)
        return next(results) if depth == 2 else sum(results)

    def root() -> None:
        with cores.one():
            assert branch(4) == 9 * 3

    threads = [threading.Thread(target=root, daemon=True) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(SOON)
        assert not thread.is_alive()
    assert ends(lambda: _all_free(cores, 3))
    assert 1 <= most <= 3


def _all_free(cores: Cores, count: int) -> None:
    while cores.free != count:
        threading.Event().wait(0.001)


def test_algebra_on_one_thread_for_as_long_as_asked() -> None:
    def threads() -> list[int]:
        return [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]

    before = threads()
    with single_threaded_algebra():
        assert set(threads()) == {1}
    assert threads() == before
