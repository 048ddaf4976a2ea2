"""Work shared among the cores."""

import threading

import pytest
from threadpoolctl import threadpool_info

from modegraph import cores


def test_results_come_in_order() -> None:
    assert list(cores.in_parallel([lambda k=k: k * k for k in range(6)])) == [k * k for k in range(6)]


def test_no_tasks_have_no_results() -> None:
    assert list(cores.in_parallel([])) == []


def test_tasks_run_together_where_a_core_is_free(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cores, "_FREE", threading.BoundedSemaphore(1))
    met = threading.Barrier(2, timeout=20.0)
    assert sorted(cores.in_parallel([met.wait, met.wait])) == [0, 1]


def test_without_a_free_core_they_run_one_after_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cores, "_FREE", threading.BoundedSemaphore(1))
    with cores.one_core():
        names = list(cores.in_parallel([threading.current_thread, threading.current_thread]))
    assert names == [threading.current_thread()] * 2


def test_a_core_that_gets_free_takes_what_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cores, "_FREE", threading.BoundedSemaphore(2))
    leave, met = threading.Event(), threading.Barrier(2, timeout=20.0)

    def other() -> None:
        with cores.one_core():
            leave.wait(20.0)

    helper = threading.Thread(target=other)
    with cores.one_core():
        helper.start()
        while cores._FREE.acquire(blocking=False):
            cores._FREE.release()

        def first() -> int:
            # The second task waits; the core of the helper takes it, and both meet.
            leave.set()
            return met.wait()

        assert sorted(cores.in_parallel([first, met.wait])) == [0, 1]
    helper.join(20.0)


def test_a_thread_that_waits_lends_its_core(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cores, "_FREE", threading.BoundedSemaphore(2))
    used = threading.Event()

    def third() -> None:
        with cores.one_core():
            used.set()

    helper = threading.Thread(target=third)

    def slow() -> bool:
        # Its owner holds the other core, and has nothing to do but wait for this.
        helper.start()
        return used.wait(20.0)

    with cores.one_core():
        assert list(cores.in_parallel([lambda: True, slow])) == [True, True]
        helper.join(20.0)
    assert cores._FREE.acquire(blocking=False)
    assert cores._FREE.acquire(blocking=False)


def test_who_stops_early_leaves_nothing_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cores, "_FREE", threading.BoundedSemaphore(1))
    with cores.one_core():
        results = cores.in_parallel([lambda: 1, lambda: 2, lambda: 3])
        assert next(results) == 1
        assert len(cores._WAITING) == 2
        results.close()  # type: ignore[attr-defined]
        assert not cores._WAITING


def test_an_error_reaches_the_caller_and_gives_the_core_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cores, "_FREE", threading.BoundedSemaphore(1))

    def fails() -> int:
        raise ValueError("of this task")

    with pytest.raises(ValueError, match="of this task"):
        list(cores.in_parallel([lambda: 1, fails]))
    assert cores._FREE.acquire(timeout=20.0)


def test_algebra_on_one_thread_for_as_long_as_asked() -> None:
    def threads() -> list[int]:
        return [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]

    before = threads()
    with cores.single_threaded_algebra():
        assert set(threads()) == {1}
    assert threads() == before
