"""Telling a person how far a build has come."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from modegraph.errors import ModegraphError

Progress = Callable[[int, int, str], None]


def silent(done: int, total: int, text: str) -> None:
    """Report nothing."""


@contextmanager
def reporting(progress: Any) -> Iterator[Progress]:
    """A callable(done, total, text) for ``progress`` = None, False, True or such a callable.

    True draws a bar on stderr, and nothing where stderr is no terminal.
    """
    if progress is None or progress is False:
        yield silent
    elif progress is True:
        with _bar() as report:
            yield report
    elif callable(progress):
        yield progress
    else:
        raise ModegraphError(
            f"progress must be None, True or a callable(done, total, text), not {type(progress).__name__}"
        )


@contextmanager
def _bar() -> Iterator[Progress]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    console = Console(stderr=True)
    if not console.is_terminal:
        yield silent
        return
    columns = (BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    words = TextColumn("{task.fields[words]}", markup=False)
    with Bar(*columns, words, console=console, transient=True) as bar:
        task = bar.add_task("build", total=None, words="")

        def report(done: int, total: int, text: str) -> None:
            bar.update(task, completed=done, total=total, words=text)

        yield report
