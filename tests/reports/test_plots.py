"""Results as pictures: what is drawn is what the result says."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from tests.support import ROOT, SPARSE_S, X, simulated
from wheelpend import Failure, Model, compare, diagnose, explain, identify, plot, predict, residuals

matplotlib = pytest.importorskip("matplotlib")
SLOW_TO_REFUTE = ["slosh", "drive_compliance", "backlash", "wheel_slip", "load_friction", "payload_step"]


@pytest.fixture(autouse=True)
def closed():
    """Without a screen, and no figure stays open."""
    matplotlib.use("Agg")
    yield
    matplotlib.pyplot.close("all")


@pytest.fixture(scope="module")
def log():
    return simulated(duration=4.0, sample=SPARSE_S, coulomb_drive__torque=0.3)


@pytest.fixture(scope="module")
def known():
    return Model.default().with_fit({n: (v, None) for n, v in X.items()})


@pytest.fixture(scope="module")
def compared(known, log):
    return compare(known, log, against={"nominal": Model.default()})


def lengths(axes):
    return [bar.get_width() for bar in axes.patches]


def test_a_comparison_is_a_line_per_model_and_a_cross_where_it_diverges(compared):
    result = compared
    axes = result.plot()
    lines = {line.get_label(): line for line in axes.lines}
    own = [(h.seconds, h.error) for h in result.horizons if h.error is not None]
    np.testing.assert_array_equal(lines["this model"].get_xydata(), own)
    assert "nominal" in lines and lines["noise floor"].get_ydata()[0] == result.noise_floor
    assert axes.get_xscale() == axes.get_yscale() == "log" and axes.get_ylabel() == "error [σ]"
    lost = [h.seconds for m in result.models for h in m.horizons if h.diverged]
    crosses = [x for line in axes.lines if line.get_marker() == "x" for x in line.get_xdata()]
    assert sorted(crosses) == sorted(lost)


def test_a_prediction_is_a_panel_per_channel_that_breaks_between_segments(known, log):
    result = predict(known, log)
    axes = result.plot()
    assert len(axes) == 3 and axes[-1].get_xlabel() == "time [s]"
    measured, predicted = axes[1].lines
    np.testing.assert_array_equal(measured.get_ydata(), result.measured[:, 1])
    drawn = predicted.get_ydata()
    gaps = np.count_nonzero(np.diff(result.segment))
    assert gaps == 8 and np.isnan(drawn).sum() == gaps + np.isnan(result.predicted[:, 1]).sum()
    np.testing.assert_array_equal(drawn[~np.isnan(drawn)], result.predicted[~np.isnan(result.predicted[:, 1]), 1])


def test_residuals_are_autocorrelations_with_the_band_of_white_noise(known, log):
    result = residuals(known, log)
    axes = result.plot()
    for panel, found in zip(axes, result.channels.values(), strict=True):
        np.testing.assert_array_equal(panel.lines[0].get_ydata(), found.autocorrelation)
        assert panel.get_title(loc="left").endswith("not white") is not found.white
        edge = panel.collections[0].get_paths()[0].vertices[:, 1]
        assert edge.max() == pytest.approx(max(found.band))


def test_an_identification_is_relative_standard_errors_and_correlations(log):
    result = identify(Model.default(), log, method="filtered", test_bias=False, fixed={"X5": 4.67})
    bars, matrix = result.plot()
    expected = [100.0 * e.sigma / abs(e.value) for n, e in result.parameters.items() if n != "X5"]
    assert lengths(bars) == pytest.approx(expected)
    shown = matrix.images[0].get_array()
    assert shown.shape == (6, 6)
    np.testing.assert_allclose(np.diag(shown), 1.0)
    assert [t.get_text() for t in matrix.get_yticklabels()] == ["X1", "X2", "X3", "X4", "X6", "X7"]


def test_a_ladder_and_a_diagnosis_are_bars(log):
    ladder = explain(Model.default(), log, without=SLOW_TO_REFUTE)
    axes = ladder.plot()
    expected = [ladder.nominal_error, ladder.base_error, *(s.error_after for s in ladder.steps)]
    assert lengths(axes) == expected
    assert [t.get_text() for t in axes.get_yticklabels()] == ["nominal", "parameters refitted", "+ coulomb_drive"]
    found = replace(ladder.first, structures=ladder.structures)
    likely = found.plot()
    assert likely.get_xlabel() == "probability [%]" and 50.0 < lengths(likely)[0] <= 100.0
    bare = replace(found, structures=()).plot()
    assert lengths(bare) == [found.error, *(c.error_after for c in found.candidates)]
    assert bare.get_title(loc="left") == "Diagnosis: effect missing"


def test_axes_that_are_given_are_drawn_into(known, log, compared):
    given = matplotlib.pyplot.subplots(3, 1)[1]
    assert list(predict(known, log).plot(ax=given)) == list(given)
    assert compared.plot(ax=given[0]) is given[0]
    with pytest.raises(Failure, match="ax must hold 3 Axes, one for each panel of this result, but it holds 1"):
        predict(known, log).plot(ax=given[0])


def test_the_users_own_style_stays_as_it_was(compared, monkeypatch):
    monkeypatch.setitem(matplotlib.rcParams, "axes.titlesize", 7.0)
    before = dict(matplotlib.rcParams)
    compared.plot()
    assert dict(matplotlib.rcParams) == before


def test_without_matplotlib_it_is_said_how_to_install_it(compared, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(Failure, match=r"A picture of a result needs matplotlib.*pip install 'wheelpend\[plots\]'"):
        compared.plot()


def test_what_has_no_picture_is_refused_with_what_has(log):
    with pytest.raises(Failure, match=r"A picture must be of a Comparison, Prediction, .* not of a Log"):
        plot(log)


def test_results_are_made_without_loading_matplotlib():
    code = "import sys, wheelpend; wheelpend.compare, wheelpend.identify; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False).returncode == 0


@pytest.mark.slow
def test_a_diagnosis_by_itself_has_probabilities_to_draw(log):
    found = diagnose(Model.default(), log, without=SLOW_TO_REFUTE)
    assert found.plot().get_xlabel() == "probability [%]"
