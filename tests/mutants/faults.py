"""The faults: each makes a proof wrong that the engine would then believe."""

from __future__ import annotations

from tests.mutants.engine_faults import ENGINE_FAULTS
from tests.mutants.kernel_faults import KERNEL_FAULTS
from tests.mutants.merging_faults import MERGING_FAULTS

FAULTS = (*KERNEL_FAULTS, *ENGINE_FAULTS, *MERGING_FAULTS)
