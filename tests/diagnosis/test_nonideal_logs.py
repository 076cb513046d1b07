"""Logs as machines write them: a clock that jitters, gaps, noise with colour, a supply that is at its end."""

from dataclasses import replace

import numpy as np
import pytest

from wheelpend import Model, diagnose
from wheelpend.benchmarks.hidden_effects.nonideal_sensors import complete_log
from wheelpend.logs.log import Log

HIDE = {"coulomb_drive.torque": 0.3}


def with_gaps(log: Log, model: Model) -> Log:
    """The log with two stretches lost, every twelfth pitch and every fiftieth encoder reading missing."""
    measured = log.measured.copy()
    measured[::12, 1] = np.nan
    measured[::50, 0] = np.nan
    kept = np.ones(len(log), dtype=bool)
    kept[1200:1330] = kept[2900:2960] = False
    cut = replace(log, measured=measured)
    return replace(cut, t=cut.t[kept], voltage=cut.voltage[kept], measured=measured[kept],
                   reference=None if log.reference is None else log.reference[kept])  # fmt: skip


@pytest.mark.parametrize(
    "kind",
    [
        "jittered clock",
        pytest.param("pitch coloured, 10 ms", marks=pytest.mark.slow),
        pytest.param("gyro coloured, 5 ms", marks=pytest.mark.slow),
        pytest.param("outliers", marks=pytest.mark.slow),
    ],
)
def test_dry_friction_is_found_and_sized_though_clock_and_sensors_are_not_ideal(kind):
    model, log = complete_log(kind, 5, hide=HIDE)
    found = diagnose(model, [with_gaps(log, model)])
    assert found.verdict == "effect_missing" and found.candidates[0].effect == "coulomb_drive"
    size, sigma = (record["torque"] for record in (found.candidates[0].coefficients, found.candidates[0].sigma))
    assert abs(size - 0.3) < max(4 * sigma, 0.006)


@pytest.mark.parametrize("kind", ["jittered clock", "pitch coloured, 10 ms"])
def test_nothing_is_missing_in_a_complete_model_though_clock_and_sensors_are_not_ideal(kind):
    model, log = complete_log(kind, 6)
    found = diagnose(model, [with_gaps(log, model)])
    assert found.verdict == "nothing_missing"


@pytest.mark.slow
def test_a_supply_at_its_end_is_found_beside_a_jittering_clock():
    model, log = complete_log("jittered clock", 7, hide={"voltage_saturation.limit": 8.0})
    assert np.abs(log.voltage).max() > 10.0  # commands beyond it are in the log
    found = diagnose(model, [with_gaps(log, model)])
    assert found.candidates[0].effect == "voltage_saturation"
    assert found.candidates[0].coefficients["limit"] == pytest.approx(8.0, rel=0.02)
