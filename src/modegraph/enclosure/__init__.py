"""Validated arithmetic; the numba kernels live here and nowhere else."""

from __future__ import annotations

from pathlib import Path


def kernels_are_compiled() -> bool:
    """Whether an earlier run left compiled kernels behind; if not, the first proof takes longer."""
    from modegraph.enclosure.step import flow_step

    # numba offers no public question for this; where its cache looks different, say nothing.
    index = getattr(getattr(getattr(flow_step, "_cache", None), "_cache_file", None), "_index_path", None)
    return index is None or Path(index).exists()
