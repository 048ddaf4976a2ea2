"""``python -m tests.mutants [name ...]``: plant every fault in turn and see that the tests catch it."""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue

from tests.mutants.fault import ROOT, SOURCE, Fault
from tests.mutants.faults import FAULTS

LIMIT = 600.0
"""Seconds for the tests of one fault; a hang counts as survived."""
COPIED = ("src", "tests", "examples", "pyproject.toml")


@dataclass(frozen=True)
class Result:
    fault: Fault
    caught: bool
    note: str
    seconds: float


class Copy:
    """A copy of the repository to spoil; ``cache`` keeps what its sound kernels compile to."""

    def __init__(self, folder: Path) -> None:
        self.root = folder / "copy"
        self.cache = folder / "cache"
        self.root.mkdir(parents=True)
        leave = shutil.ignore_patterns("__pycache__", ".*_cache")
        for name in COPIED:
            source = ROOT / name
            if source.is_dir():
                shutil.copytree(source, self.root / name, ignore=leave)
            else:
                shutil.copy2(source, self.root / name)

    def python(self, cache: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
        environment = os.environ | {
            "PYTHONPATH": str(self.root / "src"),
            "PYTHONDONTWRITEBYTECODE": "1",
            "NUMBA_CACHE_DIR": str(cache),
            "MPLBACKEND": "Agg",
        }
        return subprocess.run(
            [sys.executable, *arguments], cwd=self.root, env=environment, capture_output=True, text=True, timeout=LIMIT
        )

    def test(self, cache: Path, tests: Sequence[str]) -> subprocess.CompletedProcess[str]:
        plugins = ("-p", "no:cacheprovider", "-p", "tests.mutants.unshrunk")
        return self.python(cache, "-m", "pytest", "-x", "-q", *plugins, "-m", "not campaign", *tests)

    def is_sound(self, tests: Sequence[str]) -> bool:
        """Whether Python imports this copy, and the tests pass on it as long as it has no fault."""
        found = self.python(self.cache, "-c", "import modegraph; print(modegraph.__file__)").stdout.strip()
        if Path(found).resolve() != (self.root / SOURCE / "__init__.py").resolve():
            print(f"not the copy is imported, but {found}")
            return False
        run = self.test(self.cache, tests) if tests else None
        if run is not None and run.returncode != 0:
            print("the tests fail without any fault:", run.stdout[-2000:], run.stderr[-400:])
            return False
        return True

    def judge(self, fault: Fault) -> Result:
        begin = time.monotonic()
        path = self.root / SOURCE / fault.file
        stamp = path.stat()
        text = fault.apply(self.root)
        with tempfile.TemporaryDirectory() as fresh:
            cache = Path(fresh) if fault.in_kernel else self.cache
            try:
                run = self.test(cache, fault.tests)
                note = _verdict(run)
                if not note and "@njit" in text and not any(cache.rglob(f"{path.stem}.*.nbi")):
                    note = "the edited kernel was not compiled"
            except subprocess.TimeoutExpired:
                note = f"no end within {LIMIT:.0f} s"
            finally:
                path.write_text(text, encoding="utf-8")
                # The sound kernels in the cache stay valid: numba goes by this stamp.
                os.utime(path, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
        return Result(fault, not note, note, time.monotonic() - begin)


def _verdict(run: subprocess.CompletedProcess[str]) -> str:
    """Empty if a test failed; a copy that cannot even be collected is no catch."""
    if run.returncode == 1 and " failed" in run.stdout:
        return ""
    if run.returncode == 0:
        return "SURVIVED"
    return f"pytest ended with {run.returncode}: {run.stdout[-400:]}{run.stderr[-400:]}"


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__)
    parser.add_argument("names", nargs="*", help="parts of names of faults; all of them by default")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    chosen = [f for f in FAULTS if not options.names or any(name in f.name for name in options.names)]
    if not chosen:
        parser.error("no fault has such a name")
    with tempfile.TemporaryDirectory(prefix="modegraph-mutants-") as folder, ThreadPoolExecutor(options.jobs) as pool:
        copies = [Copy(Path(folder) / str(k)) for k in range(options.jobs)]
        tests = sorted({test for fault in chosen for test in fault.tests})
        shares = [tests[k :: options.jobs] for k in range(options.jobs)]
        if not all(pool.map(Copy.is_sound, copies, shares)):
            return 1
        free: SimpleQueue[Copy] = SimpleQueue()
        for copy in copies:
            free.put(copy)

        def judge(fault: Fault) -> Result:
            copy = free.get()
            try:
                result = copy.judge(fault)
            finally:
                free.put(copy)
            print(f"{'caught' if result.caught else 'FAILED':8s} {result.seconds:5.0f} s  {fault.name}", flush=True)
            if result.note:
                print(f"         {result.note}", flush=True)
            return result

        results = list(pool.map(judge, chosen))
    left = [result.fault.name for result in results if not result.caught]
    print(f"{len(results)} faults, {len(results) - len(left)} caught" + (f"; left: {', '.join(left)}" if left else ""))
    return 1 if left else 0


if __name__ == "__main__":
    sys.exit(main())
