"""What a model that reaches sensor noise over the horizon leaves along a whole log: it is sought only if it lasts."""

from types import SimpleNamespace

import pytest

from wheelpend.diagnosis.likelihood import search

LOG = SimpleNamespace(duration=10.0, dt=0.01)  # whose sources have correlation times of 0.005 to 0.5 s


def _force(share, time):
    return SimpleNamespace(share=share, correlation_time_s=time)


@pytest.mark.parametrize(
    ("force", "sensors", "effects", "lasts"),
    [
        (None, {}, (), False),
        (_force(0.001, 0.01), {}, (), True),  # however small it is
        (_force(0.0, 0.3), {}, (), False),
        (_force(0.001, 0.01), {}, ("coulomb_drive",), False),  # white, where a surface sticks
        (_force(0.001, 0.3), {}, ("coulomb_drive",), True),
        (None, {"dtheta_p": 0.2}, (), False),  # a gyro's noise has a colour
        (None, {"dtheta_p": 0.499}, (), True),  # or a zero that is off: as slow as such a log tells
        (None, {"theta_w": 0.2, "dtheta_p": 0.499}, ("coulomb_drive",), True),
    ],
)
def test_what_lasts_is_a_force_or_an_error_of_a_sensor_as_slow_as_the_log_tells(
    force, sensors, effects, lasts, monkeypatch
):
    errors = {channel: SimpleNamespace(correlation_time_s=time) for channel, time in sensors.items()}
    left = SimpleNamespace(strongest=force, sensors=errors)
    monkeypatch.setattr(search, "refitted_remainder", lambda problem, log_values: left)
    problem = SimpleNamespace(logs=[LOG], model=SimpleNamespace(effects=effects))
    fitted = SimpleNamespace(of_log=lambda number: {})
    assert search.leaves_what_lasts(problem, fitted, lambda text: None) is lasts
