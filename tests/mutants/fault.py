"""A deliberate fault: one small edit of the proof engine that the tests have to notice."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
SOURCE = Path("src") / "modegraph"


@dataclass(frozen=True)
class Fault:
    """``old``, which occurs exactly once in ``file`` (below src/modegraph), becomes ``new``.

    ``tests`` are pytest arguments, files or single tests, at least one of which must fail then.
    """

    name: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]

    @property
    def in_kernel(self) -> bool:
        """Whether compiled kernels change: numba does not see edits of what a cached kernel calls."""
        return self.file.startswith(("enclosure/", "expression/ops"))

    def apply(self, root: Path) -> str:
        """Edit the copy below ``root``; returns the text to put back."""
        path = root / SOURCE / self.file
        text = path.read_text(encoding="utf-8")
        if text.count(self.old) != 1:
            raise ValueError(f"{self.name}: {self.file} holds the text {text.count(self.old)} times, not once")
        path.write_text(text.replace(self.old, self.new), encoding="utf-8")
        return text
