"""A fit stays cheap in simulated samples and in memory."""

import pytest

from tests.support import simulated
from wheelpend import Model, identify, simulate
from wheelpend.estimation.shooting import Simulator


def test_an_identification_from_known_values_simulates_the_log_less_than_twenty_times(samples):
    log = simulated(duration=20.0)
    identify(Model.default(), [log])
    assert samples.keys() == {"wheel_pendulum"}  # its own kernels alone
    assert sum(samples.values()) < 20 * len(log)


@pytest.mark.slow
def test_no_fit_keeps_the_residuals_of_a_whole_log(monkeypatch):
    shoot = Simulator.shoot
    kept, log = [], simulate(Model.default(), hide={"coulomb_drive": 0.3}, duration=6.0)

    def watched(self, *args, **rest):
        shot = shoot(self, *args, **rest)
        kept.append(len(shot.residual))
        return shot

    monkeypatch.setattr(Simulator, "shoot", watched)
    monkeypatch.setattr("wheelpend.estimation.fit_statistics.MAX_COLOUR_TEST_SAMPLES", 1000)
    identify(Model.default(), [log])
    assert 0 < max(kept) < len(log) // 2
