"""``python -m modegraph``."""

from __future__ import annotations

import subprocess
import sys


def test_the_package_is_a_program() -> None:
    done = subprocess.run([sys.executable, "-m", "modegraph", "--help"], capture_output=True, text=True, check=True)
    assert "explain" in done.stdout
    wrong = subprocess.run([sys.executable, "-m", "modegraph", "fly"], capture_output=True, text=True, check=False)
    assert wrong.returncode == 2
