"""Results as a notebook shows them: a few lines, a table in HTML, and a DataFrame."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support import SPARSE_S, simulated
from wheelpend import Model, compare, explain, identify, linearize, predict, residuals
from wheelpend.diagnosis.change import Change

SLOW_TO_REFUTE = ["slosh", "drive_compliance", "backlash", "wheel_slip", "load_friction", "payload_step"]


@pytest.fixture(scope="module")
def ladder():
    log = simulated(duration=10.0, sample=SPARSE_S, coulomb_drive__torque=0.3)
    return explain(Model.default(), log, without=SLOW_TO_REFUTE)


@pytest.fixture(scope="module")
def identified():
    return identify(Model.default(), simulated(duration=4.0), method="filtered", test_bias=False)


@pytest.fixture(scope="module")
def compared():
    return compare(Model.default(), simulated(duration=4.0))


def test_an_identification_is_a_row_per_parameter(identified):
    frame = identified.to_frame()
    assert frame.columns == ["parameter", "value", "sigma", "unit", "identifiable"]
    found = {row["parameter"]: row for row in frame.to_dicts()}
    assert list(found) == list(identified.parameters)
    assert (found["X5"]["value"], found["X5"]["sigma"]) == (
        identified.parameters["X5"].value,
        identified.parameters["X5"].sigma,
    )
    first, head, *_ = repr(identified).splitlines()
    assert first == "Identification by filtered from 4001 samples"
    assert head.split() == frame.columns
    assert len(repr(identified)) < 1000


def test_a_comparison_is_a_row_per_channel(compared):
    frame = compared.to_frame()
    assert dict(frame.select("channel", "rmse").iter_rows()) == compared.rmse
    assert dict(frame.select("channel", "fit_percent").iter_rows()) == compared.fit_percent
    assert f"error {compared.error:.3g} σ over 0.5 s" in repr(compared)


def test_a_ladder_is_a_row_per_parameter_of_each_step(ladder):
    (row,) = ladder.to_frame().to_dicts()
    (step,) = ladder.steps
    assert (row["step"], row["effect"], row["parameter"]) == (1, "coulomb_drive", "torque")
    assert row["value"] == step.coefficients["torque"] and row["sigma"] == step.sigma["torque"]
    assert row["error_before"] == step.error_before > row["error_after"] == step.error_after
    assert repr(ladder).startswith(f"Ladder: nothing_missing, error {ladder.base_error:.3g} -> {ladder.error:.3g} σ")
    assert ", 1 step\n" in repr(ladder)


def test_a_diagnosis_is_a_row_per_parameter_of_each_candidate(ladder):
    found = ladder.first
    frame = found.to_frame()
    assert frame["effect"].unique(maintain_order=True).to_list() == [c.effect for c in found.candidates]
    assert frame["p_value"][0] == found.candidates[0].p_value
    assert repr(found).startswith("Diagnosis: effect_missing, error")


def test_a_table_without_rows_keeps_its_columns(ladder):
    assert ladder.last.candidates == ()
    assert ladder.last.to_frame().columns == ladder.first.to_frame().columns
    assert "<table>" not in ladder.last._repr_html_()


def test_a_change_is_a_ladder_of_one_step(ladder):
    change = Change(ladder.steps[0], ladder.model, ladder.problem, ladder.fit, ladder.fit)
    assert change.to_frame().equals(ladder.to_frame())
    assert repr(change).startswith("Change: coulomb_drive, error")


def test_residual_tests_are_a_row_per_channel():
    found = residuals(Model.default(), simulated(duration=4.0))
    frame = found.to_frame()
    assert frame["channel"].to_list() == list(found.channels)
    assert frame["whiteness_p"].to_list() == [c.whiteness_p for c in found.channels.values()]
    coloured = frame.filter(~frame["white"])["channel"].to_list()
    assert all(name in repr(found).splitlines()[0] for name in coloured)


def test_what_others_wrote_is_escaped_in_html(identified):
    html = replace(identified, warnings=("<script>alert(1)</script>", "a\u202eb"))._repr_html_()
    assert "<li>&lt;script&gt;alert(1)&lt;/script&gt;</li>" in html and "<script>" not in html
    assert "a\\u202eb" in html
    assert "<th>parameter</th>" in html and "<td>X1</td>" in html


def test_warnings_are_counted_and_long_tables_cut(identified):
    many = {f"Z{k}": identified.parameters["X1"] for k in range(30)}
    lines = repr(replace(identified, parameters=many, warnings=("one", "two"))).splitlines()
    assert lines[-2:] == ["... and 18 more: see .to_frame()", "2 warnings: see .warnings"]
    assert len(lines) == 1 + 1 + 12 + 2
    assert replace(identified, parameters=many).to_frame().height == 30


def test_the_covariance_of_the_estimates_has_their_standard_errors():
    found = identify(Model.default(), simulated(duration=4.0), method="shooting")
    assert found.covariance.matrix.shape == (len(found.covariance.names),) * 2
    sigma = dict(zip(found.covariance.names, np.sqrt(np.diag(found.covariance.matrix)), strict=True))
    assert sigma == pytest.approx({n: e.sigma for n, e in found.parameters.items()}, rel=1e-6)
    frame = found.covariance.to_frame()
    assert frame.columns == ["parameter", *found.covariance.names]
    np.testing.assert_array_equal(frame.drop("parameter").to_numpy(), found.covariance.matrix)


def test_a_model_says_in_one_line_what_it_is():
    model = Model.default().with_effects(["coulomb_drive"])
    assert repr(model) == f"<Model {str(model.path or 'not saved')!r}: wheel_pendulum with coulomb_drive; 7 values>"


def test_a_model_predicts_and_is_linearised_by_its_own_methods_too():
    log, model = simulated(duration=2.0), Model.default()
    assert np.array_equal(model.predict(log).predicted, predict(model, log).predicted, equal_nan=True)
    assert np.array_equal(model.linearize().A, linearize(model).A)
    assert model.predict(log, horizon=1.0).to_frame()["segment"].max() < model.predict(log).to_frame()["segment"].max()
