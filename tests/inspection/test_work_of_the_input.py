"""A sign is not turned round against the work that an input does on a machine."""

import numpy as np
import pytest

from wheelpend import Model
from wheelpend.inspection.equations import takes_work
from wheelpend.inspection.signals import uniform_signals
from wheelpend.logs.log import Log
from wheelpend.model.model_kernels import library_module_of

SLIDE = Model.parse('plant = "slide"\n')
MODULE = library_module_of(SLIDE, [])
T = 0.01 * np.arange(800)


def signals_of(speed, volts):
    log = Log.from_arrays(T, table=SLIDE.table, v_in=volts, x=np.cumsum(speed) * 0.01)
    return uniform_signals(log, "v_in", in_range=True)


HELD = 12.0 + 0.5 * np.sin(7.0 * T)  # a speed that a controller holds: it gives less where the speed is more
OPPOSED = 0.3 - 0.1 * np.sin(7.0 * T)


@pytest.mark.parametrize(
    ("speed", "volts", "works"),
    [
        (HELD, OPPOSED, True),
        (HELD, -OPPOSED, False),
        (HELD * np.exp(-0.3 * T), OPPOSED, False),  # it slows down: what it gives may be its own
        (np.sin(5.0 * T), np.cos(5.0 * T), False),  # to and fro, a quarter ahead: it only accelerates
    ],
)
def test_an_input_that_works_on_a_machine_which_gets_no_slower_has_its_sign(speed, volts, works):
    assert takes_work(signals_of(speed, volts), MODULE) == works
