"""NumPy is only different for the traced function itself."""

import threading
from types import ModuleType

import numpy as np
import pytest

from modegraph.expression import Graph, TracedArray
from modegraph.expression.depth import paused
from modegraph.expression.namespace import _TracedModule, tracing


def test_undone_even_after_an_error() -> None:
    original = np.zeros
    with pytest.raises(KeyError), tracing():
        {}[np.zeros is original]
    assert np.zeros is original
    assert type(np) is ModuleType
    assert type(np.linalg) is ModuleType


def test_nesting_and_pausing() -> None:
    with tracing(), tracing():
        assert isinstance(np.zeros(2), TracedArray)
        with paused():
            assert type(np.zeros(2)) is np.ndarray
        assert isinstance(np.zeros(2), TracedArray)
    assert type(np.zeros(2)) is np.ndarray


def test_other_threads_see_numpy_as_it_is() -> None:
    seen: list[object] = []
    with tracing():
        thread = threading.Thread(target=lambda: seen.extend([np.zeros, np.zeros(2), np.linalg.solve]))
        thread.start()
        thread.join()
    assert seen[0] is np.zeros
    assert type(seen[1]) is np.ndarray
    assert seen[2] is np.linalg.solve


def test_libraries_see_numpy_as_it_is() -> None:
    import scipy.linalg

    with tracing():
        value = scipy.linalg.expm(np.asarray([[0, 1], [0, 0]], dtype=float))
        assert type(value) is np.ndarray
        assert value.dtype == np.float64


def test_traces_in_parallel() -> None:
    failures: list[BaseException] = []

    def work() -> None:
        try:
            for _ in range(50):
                with tracing():
                    a = np.zeros(2)
                    a[0] = Graph().variable("x")
        except BaseException as error:
            failures.append(error)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failures
    assert type(np) is ModuleType


def test_arrays_by_dtype() -> None:
    with tracing():
        assert isinstance(np.zeros((2, 2), dtype=float), TracedArray)
        assert np.zeros(2, dtype=int).dtype.kind == "i"
        assert np.array([1, 2]).dtype.kind == "i"
        assert isinstance(np.array([1.0, 2.0]), TracedArray)
        assert np.full(2, True).dtype.kind == "b"


def test_a_look_up_survives_the_end_of_the_last_trace_in_another_thread() -> None:
    """The module was being traced when the attribute was asked for, and is plain before it is found."""
    assert type(np) is ModuleType
    assert _TracedModule.__getattribute__(np, "zeros") is np.zeros
