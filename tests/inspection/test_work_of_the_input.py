"""A sign is not turned round against the work that an input does on a machine."""

import numpy as np
import pytest

from wheelpend import Model
from wheelpend.inspection.equations import takes_work
from wheelpend.inspection.inspect import inspect_for_model
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


@pytest.mark.parametrize(("sign", "word"), [(1.0, "follows"), (-1.0, "opposes")])
def test_a_load_that_opposes_all_motion_of_a_slide_is_said_to_count_the_other_way(sign, word):
    t = 0.01 * np.arange(3000)
    way = 0.3 * np.sin(2.0 * t) + 0.1 * np.sin(5.3 * t)
    speed = np.gradient(way, t)
    noise = np.random.default_rng(4).normal(size=(2, t.size))
    given = sign * (2.0 * np.sign(speed) + 0.1 * speed + 1e-3 * noise[0])
    log = Log("bench", t, given, (way + 1e-5 * noise[1])[:, None], ("x",), rates={})
    findings = inspect_for_model(Model.parse('plant = "slide"\n'), log).findings
    (found,) = (f for f in findings if f.kind == "friction_like_input")
    assert f"v_in {word} the sign of the rate of x" in found.sentence
    assert ("set sign = -1" in found.cure) is (sign < 0.0)
