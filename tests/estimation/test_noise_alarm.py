"""An error well below the noise floor says that σ is overstated."""

import re

import numpy as np
import pytest

from tests.support import X, simulated
from wheelpend import Model, compare, identify
from wheelpend.estimation.data import prepare
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.noise_alarm import overstated_noise
from wheelpend.estimation.parameter_table import standard_error
from wheelpend.estimation.parameters import FreeParameter

STATED = "\n[sensors.noise]\ntheta_p = 0.03\ndtheta_p = 0.02\n"
VALUES = "[parameters]\n" + "".join(f"{n} = {{ nominal = {v} }}\n" for n, v in X.items())
LOUD = Model.parse('plant = "wheel_pendulum"\n' + VALUES + "[sensors]\nencoder_counts = 60000\n" + STATED)
KNOWN = Model.parse('plant = "wheel_pendulum"\n' + VALUES + "[sensors]\nencoder_counts = 60000\n")


def test_stated_noise_that_is_too_large_is_an_alarm_that_names_the_channels():
    (warning,) = compare(LOUD, [simulated(duration=8.0)]).warnings
    assert "well below the noise floor" in warning and "theta_p 0.2" in warning and "dtheta_p 0.4" in warning
    assert "theta_w" not in warning
    (line,) = re.findall(r"under \[sensors\] in model.toml: (noise = .* })\.$", warning)
    mended = Model.parse(LOUD.text.replace(STATED, f"\n{line}\n"))
    assert mended.sensors.noise == pytest.approx({"theta_p": 0.0087, "dtheta_p": 0.0087}, abs=2e-4)
    assert compare(mended, [simulated(duration=8.0)]).warnings == ()


def test_identify_gives_the_alarm_and_a_good_log_does_not():
    (warning,) = [w for w in identify(LOUD, [simulated(duration=8.0)]).warnings if "σ is overstated" in w]
    assert "`wheelpend residuals LOG` prints the lines for model.toml" in warning
    assert identify(KNOWN, [simulated(duration=8.0)]).warnings == ()


def test_a_low_error_on_few_samples_is_chance():
    problem = prepare(KNOWN, [simulated(duration=8.0)], lean=True)
    few = [s.__class__(s.log, s.sigma, s.bounds[:1, :] // [1, 10] + [0, 6]) for s in problem.data.estimation]
    assert few[0].values < 200
    assert overstated_noise(problem, 0.85, few) == ()
    assert overstated_noise(problem, 0.85, problem.data.estimation) != ()
    assert overstated_noise(problem, 0.95, problem.data.estimation) == ()


@pytest.mark.parametrize("repeats, expected", [(False, 1.0), (True, 3.0)])
def test_an_encoder_that_repeats_its_counts_gives_the_larger_of_both_standard_errors(repeats, expected):
    problem = prepare(KNOWN, [simulated(duration=8.0)], lean=True)
    problem = problem.__class__(**{**vars(problem), "noise": (problem.noise[0]._replace(repeats=repeats),)})
    one = np.array([[1.0]])
    fitted = Fit({"X1": 1.0}, (), (FreeParameter("X1", None),), one, 9.0 * one, (), 0.0, 1, 1.0, (), True)
    assert standard_error(problem, fitted, "X1") == expected
