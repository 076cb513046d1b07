"""A generated module offers what the runtime takes from it."""

from typing import get_type_hints

import derive
from wheelpend.kernels.kernel_module import KernelModule, ModelConstants, RegressionKernels, SimulationKernels


def test_a_module_has_every_attribute_of_its_type(lean, library):
    for module in (lean, library):
        for part in (ModelConstants, SimulationKernels, RegressionKernels):
            assert not [n for n in get_type_hints(part) if not hasattr(module, n)]
    assert {*get_type_hints(SimulationKernels)} < {*get_type_hints(KernelModule)}


def test_its_facts_are_those_of_the_effect_library(lean, library):
    assert library.PARAMETERS[: library.OWN_PARAMETERS] == lean.PARAMETERS
    present = [e for e in derive.effects.EFFECT_LIBRARY.values() if e.full_names[0] in library.PARAMETERS]
    assert set(library.CARRYING) == {e.name for e in present if e.carries}
    assert [library.PARAMETERS[k] for k in library.HYSTERESIS_SIZES] == [e.full_names[0] for e in present if e.carries]
    assert library.MISSING_FORCES == ("missing.wheel", "missing.body") and lean.MISSING_FORCES == ()
