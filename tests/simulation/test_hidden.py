"""What is hidden in a simulated log is named as in the library, and never passed over."""

import pytest

from wheelpend import Failure, Model, simulate


def test_hidden_effects_are_never_passed_over():
    whole = simulate(Model.default(), duration=0.5, hide={"coulomb_drive.torque": 0.3})
    assert (simulate(Model.default(), duration=0.5, hide={"coulomb_drive": 0.3}).voltage == whole.voltage).all()
    for name, answer in {"coulomb": "Known effects", "cogging": "cogging.periods", "slope.tilt": "slope.angle"}.items():
        with pytest.raises(Failure, match=answer):
            simulate(Model.default(), duration=0.5, hide={name: 0.3})
