"""What a model does not state and does not need does not show in its kernels."""

import numpy as np
import pytest

import derive
from tests.export.exporting import interpreted
from wheelpend.kernels.load import library_text


def assumed_otherwise():
    """Each plant with one assumption at a value that it has not by default."""
    for plant in ("wheel_pendulum", "cart_pole", "pendulum", "slide"):
        for one in derive.plants.assumptions_of(plant):
            for value in one.choices:
                if value != one.default:
                    yield pytest.param(plant, {one.name: value}, id=f"{plant}-{one.name}-{value}")


@pytest.mark.parametrize(("plant", "assumptions"), [*assumed_otherwise()])
def test_kernels_give_numbers_whatever_is_assumed_while_no_constant_is_known(plant, assumptions):
    try:
        complete = derive.plants.complete_assumptions(plant, assumptions)
    except (ValueError, KeyError) as error:
        pytest.skip(str(error))
    kernels = interpreted(library_text(plant, complete))
    parameters = np.array(kernels.ABSENT)
    parameters[: kernels.OWN_PARAMETERS] = 1.0 + 0.3 * np.arange(kernels.OWN_PARAMETERS)
    now = np.full(kernels.NX, 0.1)
    given = np.full(len(kernels.INPUTS), 0.2) if len(kernels.INPUTS) > 1 else 0.2
    rates = kernels.acceleration(0.0, now, given, parameters)
    assert np.isfinite(rates).all(), rates
