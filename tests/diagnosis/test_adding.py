"""Adding one effect where sensor noise is out of reach, and what is said of one that should not have been added."""

from types import SimpleNamespace

import pytest

from tests.diagnosis.test_likelihood import DRY, MODEL, axis_log
from wheelpend import Model, add
from wheelpend.diagnosis.change import _added_in_vain
from wheelpend.estimation.data import prepare

AXIS = Model.parse(MODEL)


@pytest.fixture(scope="module")
def change():
    return add(AXIS, "coulomb_drive", axis_log(DRY, 2))


def test_beside_a_random_force_an_effect_is_added_by_likelihood_with_the_size_that_it_has(change):
    """Over half-second segments, each with a start of its own, the force makes it 0.46 ± 0.03 V on this log."""
    torque = change.step.estimates["torque"]
    assert abs(torque.value - DRY) < 3.0 * torque.sigma < 0.1 * DRY
    assert change.step.error_after < change.step.error_before
    assert change.model.estimates()["coulomb_drive.torque"]["value"] == pytest.approx(torque.value)
    assert 0.5 < change.remainder.strongest.rms / 0.1 < 1.5 and not change.warnings


def step(torque: float, sigma: float, before: float, after: float) -> SimpleNamespace:
    return SimpleNamespace(
        effect="coulomb_drive", coefficients={"torque": torque}, sigma={"torque": sigma}, per_log=(),
        error_before=before, error_after=after,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("added", "said"),
    [
        (step(0.6, 0.1, 12.0, 9.0), []),
        (step(-0.6, 0.1, 12.0, 9.0), ["a size that nothing has (torque = -0.6)"]),
        (step(-0.1, 0.1, 12.0, 9.0), []),  # within its error it may be zero
        (step(0.6, 0.1, 12.0, 15.0), ["predicts held-out data less well, 12 σ before and 15 σ after"]),
        (step(-0.6, 0.1, 12.0, 15.0), ["a size that nothing has", "`wheelpend remove coulomb_drive LOG`"]),
    ],
)
def test_an_effect_that_should_not_have_been_added_comes_with_a_warning(added, said):
    found = _added_in_vain(prepare(AXIS, axis_log(DRY, 1)), added)
    assert len(found) == len(said) and all(text in sentence for text, sentence in zip(said, found, strict=True))
