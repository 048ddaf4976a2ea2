"""The list of faults fits the sources: an edit that no longer applies tests nothing."""

from __future__ import annotations

import pytest

from tests.mutants.fault import ROOT, SOURCE, Fault
from tests.mutants.faults import FAULTS


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_fault_applies_once_and_names_tests_that_exist(fault: Fault) -> None:
    text = (ROOT / SOURCE / fault.file).read_text(encoding="utf-8")
    assert text.count(fault.old) == 1
    compile(text.replace(fault.old, fault.new), fault.file, "exec")
    assert fault.tests
    for test in fault.tests:
        path, _, name = test.partition("::")
        assert f"def {name}" in (ROOT / path).read_text(encoding="utf-8")


def test_names_differ() -> None:
    assert len({fault.name for fault in FAULTS}) == len(FAULTS) >= 14
