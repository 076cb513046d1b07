"""Every effect is drawn from its row: its law, over what the log covers, with a band."""

from dataclasses import replace

import numpy as np
import pytest

import derive
from derive.effects import Deformation, Effect, EffectParameter, Force, InputMap, SensorMap
from tests.support import simulated
from wheelpend import Model
from wheelpend.estimation.data import prepare
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import known_values
from wheelpend.estimation.parameters import FreeParameter
from wheelpend.reports.page.effect_figures import confidence_band, effect_figure
from wheelpend.reports.page.effect_laws import effect_plot


@pytest.fixture(scope="module")
def problem():
    return prepare(Model.default(), [simulated(duration=9.0)])


def fitted(problem, effect, sigma=0.01, size=1.0):
    """A fit that found an effect at its typical size, known to a share of it."""
    own = {n: p.typical * size for n, p in zip(effect.full_names, effect.parameters, strict=True)}
    covariance = np.diag([(sigma * v) ** 2 for v in own.values()])
    values = {**known_values(problem.model), **own}
    free = tuple(FreeParameter(n) for n in own)
    return replace(Fit.at(values), free=free, covariance=covariance, robust=covariance)


def drawn(problem, effect, size=1.0):
    fit = fitted(problem, effect, size=size)
    picture = effect_plot(effect, problem, fit)
    return picture, picture.lines({n: fit.values[n] for n in effect.full_names})


def possible(problem):
    changed = [e for e in derive.effects.EFFECT_LIBRARY.values() if e.full_names[0] in problem.module.PARAMETERS]
    return [e for e in changed if not isinstance(e.enters, Deformation)]


def test_every_law_of_the_library_is_drawn_within_what_the_log_covers(problem):
    for effect in possible(problem):
        picture, lines = drawn(problem, effect)
        assert lines and all(np.isfinite(y).all() and y.shape == picture.x.shape for y in lines.values()), effect.name
        assert effect.event or any(np.ptp(y) > 0 or np.any(y) for y in lines.values()), effect.name
        assert "[" in picture.x_label and picture.y_label


def test_a_band_holds_the_line_and_grows_with_the_error_of_the_coefficients(problem):
    effect = derive.effects.find("wheel_runout")
    widths = []
    for sigma in (0.01, 0.1):
        fit = fitted(problem, effect, sigma)
        values = {n: fit.values[n] for n in effect.full_names}
        lines = effect_plot(effect, problem, fit).lines
        low, high = confidence_band(lines, "", values, fit, 0)
        widths.append(np.mean(high - low))
        assert np.mean((low <= lines(values)[""]) & (lines(values)[""] <= high)) > 0.8
    assert widths[1] > 5 * widths[0]


def test_a_change_of_geometry_is_the_force_that_holds_the_machine_at_rest(problem):
    picture, lines = drawn(problem, derive.effects.find("com_offset"))
    body = known_values(problem.model)["X5"] * (np.sin(picture.x + 0.02) - np.sin(picture.x))
    assert list(lines) == ["body row"] and lines["body row"] == pytest.approx(body)


def test_a_small_change_of_the_voltage_is_magnified_and_a_large_one_shown_whole(problem):
    effect = derive.effects.find("voltage_offset")
    assert drawn(problem, effect)[1][""] == pytest.approx(0.2)
    picture, lines = drawn(problem, effect, size=50.0)
    assert lines[""] == pytest.approx(picture.x + 10.0)


def own_effect(enters, **parameters):
    rows = tuple(EffectParameter(n, "V", typical=v) for n, v in parameters.items())
    return Effect("mine", "body", "A law of one's own.", "", rows, enters)


def test_a_law_of_several_things_is_drawn_along_the_log(problem):
    pitch = derive.functions.symbol("theta_p")
    wind = own_effect(Force("ground", lambda a, v, k: k * v * pitch), k=0.2)
    hum = own_effect(InputMap(lambda v, t, size: v + size * derive.functions.symbol("dtheta_p")), size=0.1)
    late = own_effect(SensorMap("theta_p", lambda reading, k: reading + k * derive.functions.symbol("dtheta_w")), k=0.1)
    for effect in (wind, hum, late):
        picture, lines = drawn(problem, effect)
        assert picture.x_label == "time [s]" and 4.5 < np.ptp(picture.x) <= 5.0
        assert np.isfinite(lines[""]).all() and np.ptp(lines[""]) > 0


def test_what_has_no_law_to_draw_is_shown_by_what_it_changes_in_the_readings(problem):
    effect = derive.effects.find("coulomb_drive")
    strange = Effect(effect.name, "drive", "", "", effect.parameters, None)
    picture, lines = drawn(problem, strange)
    assert picture.y_label == "change of the readings [σ]" and list(lines) == ["theta_w", "theta_p", "dtheta_p"]
    assert 0.3 < np.ptp(picture.x) < 0.6 and np.abs(lines["theta_w"]).max() > 10


def test_a_drawing_says_what_a_volt_is_worth(problem):
    effect = derive.effects.find("coulomb_drive")
    figure = effect_figure(effect, problem, fitted(problem, effect))
    assert "N·m" in figure.data[-1].hovertemplate
    assert figure.layout.xaxis.title.text == "speed at the drive [rad/s]"
