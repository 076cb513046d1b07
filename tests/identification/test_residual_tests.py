"""Residual tests of the robot: white and independent where the model is complete, and what is said where it is not."""

from dataclasses import replace

import pytest

from tests.support import X, simulated
from wheelpend import Model, compare, residuals
from wheelpend.identification import residual_tests
from wheelpend.identification.remainder import Remainder
from wheelpend.reports.text.comparison import comparison_text
from wheelpend.reports.text.residuals import meaning_text, noise_lines


def at_truth(model):
    return model.with_fit({name: (value, None) for name, value in X.items()})


@pytest.fixture(scope="module")
def complete():
    return residuals(at_truth(Model.default()), [simulated(seed=1)])


def test_a_complete_model_leaves_white_residuals_of_the_size_of_the_noise(complete):
    assert set(complete.channels) == {"theta_w", "theta_p", "dtheta_p"} and not complete.fitted_first
    for channel in complete.channels.values():
        assert channel.white and channel.independent_of_input_p > 1e-3
        assert channel.sigma_ratio == pytest.approx(1.0, abs=0.03)
        assert abs(channel.quantiles[5][1]) < 0.05 and channel.samples > 15000
    assert meaning_text(complete.channels["theta_p"]) == "white, at the noise found in the log."
    assert meaning_text(complete.channels["theta_w"]) == "white, at the noise of rounding to its step."
    assert not list(noise_lines(complete, Model.default()))
    assert not complete.remainder.force


def test_a_comparison_makes_the_same_tests_and_says_what_they_mean():
    model, log = at_truth(Model.default()), simulated(seed=1, duration=8.0)
    compared = compare(model, [log])
    assert compared.to_json()["residuals"] == compared.residual_tests.channels
    for name, alone in residuals(model, [log]).channels.items():
        beside = compared.residual_tests.channels[name]
        assert beside.white == alone.white and beside.sigma_ratio == pytest.approx(alone.sigma_ratio, rel=0.01)
        assert beside.sigma_assumed == alone.sigma_assumed and beside.quantised == alone.quantised
        assert alone.samples - 200 < beside.samples < alone.samples  # a comparison begins after a delay's memory
    said = "\n".join(block for block in comparison_text(compared, model) if isinstance(block, str))
    assert "inform and do not decide" in said and "  theta_p: white, at the noise found in the log." in said


def test_a_comparison_whose_residuals_cannot_be_tested_says_why_and_gives_the_rest(monkeypatch):
    monkeypatch.setattr(residual_tests, "MAX_TESTED_SAMPLES", 10)
    compared = compare(at_truth(Model.default()), [simulated(seed=1, duration=3.0)])
    assert compared.residual_tests is None and compared.to_json()["residuals"] is None
    assert compared.remainder is not None and compared.error == pytest.approx(1.0, abs=0.05)
    (warning,) = [w for w in compared.warnings if "residuals" in w]
    assert warning.endswith("but they have 3001. `wheelpend residuals LOG` tests them.")


def test_noise_that_is_stated_too_small_is_understated_and_no_fault_of_the_physics(complete):
    pitch = complete.channels["theta_p"]
    assert meaning_text(replace(pitch, sigma_ratio=6.0, basis="rounding")).startswith(
        "white at 6 times the noise of rounding to its step: the noise is understated, not the physics."
    )
    assert "overstated" in meaning_text(replace(pitch, sigma_ratio=0.2))


def test_a_few_readings_that_are_far_off_are_no_noise_to_be_stated(complete):
    few, model = replace(complete.channels["theta_p"], sigma_ratio=7.5, kurtosis=1900.0), Model.default()
    assert "which few readings make" in meaning_text(few) and "understated" not in meaning_text(few)
    assert not list(noise_lines(replace(complete, channels={"theta_p": few}), model))
    often = replace(few, kurtosis=20.0)
    assert "understated" in meaning_text(often)
    assert list(noise_lines(replace(complete, channels={"theta_p": often}), model))


def test_noise_that_is_overstated_is_given_as_lines_for_the_model_file_that_then_hold():
    stated = at_truth(Model.default()).text + "\n[sensors.noise]\ndtheta_p = 0.05\n"
    loud, log = Model.parse(stated), simulated(seed=1, duration=8.0)
    found = residuals(loud, [log])
    assert meaning_text(found.channels["dtheta_p"]).startswith("white at 0.17 times the noise stated in model.toml")
    said, lines = noise_lines(found, loud)
    assert said.endswith("to copy into model.toml, under [sensors.noise]:")
    assert not list(noise_lines(replace(found, remainder=Remainder(sensors={"dtheta_p": None})), loud))
    line = lines.strip().partition("#")
    assert line[0].startswith("dtheta_p = 0.008") and line[2] == " rad/s"
    mended = Model.parse(stated.replace("dtheta_p = 0.05", line[0]))
    again = residuals(mended, [log])
    assert again.channels["dtheta_p"].sigma_ratio == pytest.approx(1.0, abs=0.02)
    assert not list(noise_lines(again, mended))


def test_a_missing_friction_colours_the_encoder_and_past_inputs_tell_of_it():
    model = at_truth(Model.default())
    found = residuals(model, [simulated(seed=1, coulomb_drive__torque=0.3)])
    wheel = found.channels["theta_w"]
    assert not wheel.white and wheel.independent_of_input_p < 1e-6
    assert found.channels["theta_p"].white  # its noise is far above what the friction does to it
    assert found.remainder.force["wheel"].rms > 0.05
    assert "Past inputs predict it" in meaning_text(wheel)


def test_the_random_force_of_the_model_file_is_the_one_that_is_used():
    text = at_truth(Model.default()).text
    model = Model.parse(text + "\n[random_force.wheel]\nrms = 0.5\ncorrelation_time = 0.05\n")
    found = residuals(model, [simulated(seed=1, duration=5.0)])
    assert found.remainder.force["wheel"].rms == 0.5
    assert found.channels["theta_w"].sigma_ratio < 0.97  # the filter expects more than there is
