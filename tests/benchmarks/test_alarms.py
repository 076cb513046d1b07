"""Sensors that are not ideal raise no false alarm, and the tables count them."""

import numpy as np
import pytest

from wheelpend.benchmarks.hidden_effects.alarms import (
    EffectPValue,
    FalseAlarmTrial,
    alarm_table,
    diagnose_log,
    effect_p_values,
    p_value_table,
)
from wheelpend.benchmarks.hidden_effects.nonideal_sensors import coloured

SLOW_KINDS = ("pitch coloured, 10 ms", "coarse encoder", "outliers")


@pytest.mark.parametrize(
    "kind", ["pitch wanders, 0.5 s", *(pytest.param(kind, marks=pytest.mark.slow) for kind in SLOW_KINDS)]
)
def test_sensors_that_are_not_ideal_raise_no_alarm(kind):
    found = diagnose_log(kind, 7003)
    assert (found.verdict, found.named) == ("nothing_missing", ())
    assert np.abs(found.deviations).max() < 4


def test_where_absence_is_a_corner_the_count_of_starts_is_cautious():
    found = effect_p_values("white", 7001, ("voltage_dead_zone", "actuator_delay"))
    assert {c.effect for c in found} == {"voltage_dead_zone", "actuator_delay"}
    assert all(c.trials > 1 and c.p_value * c.trials > 0.05 for c in found)


def test_noise_of_a_colour_keeps_its_size():
    assert coloured(0.01)(np.random.default_rng(0), 100_000, 0.001).std() == pytest.approx(1, abs=0.03)


def test_tables_count_alarms_and_chances():
    alarm = FalseAlarmTrial("white", 1, "nothing_missing", (), 1.0, 1.0, (0.5, -2.5))
    assert "0 of 1" in alarm_table([alarm]) and "1 of 2" in alarm_table([alarm])
    assert "1 of 2" in p_value_table([EffectPValue("white", "slope", 0.01, 5), EffectPValue("white", "slope", 0.5, 5)])
