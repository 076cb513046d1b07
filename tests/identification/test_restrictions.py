"""Fixed values and bounds of single parameters in `identify`."""

import json

import numpy as np
import pytest

from derive.effects import find
from tests.support import X, run, simulated
from wheelpend import Failure, Model, identify, save_log

LINEAR_METHODS = ("filtered", "recursive", "energy", "inverse", "differentiation")
LOWEST_X1 = 0.05  # V s²/rad, above the machine's


def found(method="filtered", **options):
    return identify(Model.default(), simulated(duration=4.0), method=method, test_bias=False, **options)


@pytest.mark.parametrize("method", [*LINEAR_METHODS, "iv", "shooting"])
def test_a_fixed_parameter_keeps_its_value_and_has_no_error(method):
    result, free = found(method, fixed={"X5": 4.6}), found(method)
    assert (result.parameters["X5"].value, result.parameters["X5"].sigma) == (4.6, 0.0)
    assert list(result.parameters) == list(free.parameters)
    assert result.fixed == ("X5",) and "fixed: X5" in result.headline()
    assert "X5" not in result.covariance.names and len(result.covariance.names) == 6
    assert result.parameters["X4"].value != free.parameters["X4"].value


@pytest.mark.slow
def test_the_filter_error_method_keeps_fixed_values_too():
    result = found("filter_error", fixed={"X5": X["X5"], "X6": X["X6"], "X7": X["X7"]})
    assert [n for n in result.parameters if result.parameters[n].sigma == 0.0] == ["X5", "X6", "X7"]
    assert result.parameters["X4"].value == pytest.approx(X["X4"], rel=0.01)
    assert result.error == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("method", LINEAR_METHODS)
def test_fixing_a_parameter_at_its_estimate_changes_no_other(method):
    free = found(method)
    held = found(method, fixed={"X6": free.parameters["X6"].value})
    values = {n: e.value for n, e in held.parameters.items()}
    assert values == pytest.approx({n: e.value for n, e in free.parameters.items()}, rel=1e-3)
    errors = {n: e.sigma for n, e in held.parameters.items()}
    assert all(errors[n] <= 1.001 * e.sigma for n, e in free.parameters.items())


@pytest.mark.parametrize("method", ["filtered", "energy", "inverse", "differentiation", "shooting"])
def test_a_bound_holds_an_estimate_and_is_named(method):
    free = found(method).parameters["X1"].value
    bound = free + 0.3 * abs(free)
    result = found(method, bounds={"X1": (bound, None)})
    assert result.parameters["X1"].value == pytest.approx(bound, rel=1e-9)
    assert result.at_bounds == {"X1": bound} and "at a bound: X1" in repr(result)
    assert any(w.startswith("X1 ended at its bound") and "a smaller value" in w for w in result.warnings)


@pytest.mark.parametrize("method", ["filtered", "shooting"])
def test_bounds_that_hold_nothing_change_nothing(method):
    result, free = found(method, bounds={"X1": (None, 10.0), "X5": (0.0, 10.0)}), found(method)
    assert {n: e.value for n, e in result.parameters.items()} == {n: e.value for n, e in free.parameters.items()}
    assert not result.at_bounds and result.warnings == free.warnings


def test_a_bound_gives_the_least_squares_within_it():
    log, bound = simulated(duration=4.0), LOWEST_X1
    held = identify(Model.default(), log, method="filtered", test_bias=False, bounds={"X1": (bound, 1.0)})
    fixed = identify(Model.default(), log, method="filtered", test_bias=False, fixed={"X1": bound})
    values = {n: e.value for n, e in held.parameters.items()}
    assert values == pytest.approx({n: e.value for n, e in fixed.parameters.items()}, rel=1e-6)


def test_a_parameter_of_an_effect_is_fixed_by_its_dotted_name():
    log = simulated(duration=4.0, coulomb_drive__torque=0.3)
    model = Model.default().with_effects(["coulomb_drive"])
    result = identify(model, log, method="shooting", fixed={"coulomb_drive.torque": 0.3})
    assert result.parameters["coulomb_drive.torque"].value == 0.3 and result.error < 1.1
    held = identify(model, log, method="shooting", bounds={"coulomb_drive.torque": (0.0, 0.2)})
    assert held.at_bounds == {"coulomb_drive.torque": 0.2} and held.error > 1.5


def test_a_fixed_value_is_written_without_an_error():
    fitted = found(fixed={"X5": 4.6}).model
    assert fitted.parameters["X5"].identified == 4.6 and fitted.parameters["X5"].sigma is None
    assert fitted.parameters["X4"].sigma > 0.0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"fixed": {"X55": 1.0}}, "No parameter named 'X55' can be fixed. The model has: X1, .* Did you mean 'X5'"),
        ({"bounds": {"x1": (0, 1)}}, "No parameter named 'x1' can be bounded"),
        ({"fixed": {"X5": float("nan")}}, "X5 must be fixed at a finite number, not nan"),
        ({"fixed": {"X5": "heavy"}}, "X5 must be fixed at a finite number, not 'heavy'"),
        ({"fixed": {"X5": -1.0}}, "X5 must be at least 0, but it is fixed at -1"),
        ({"bounds": {"X1": (1.0, 0.5)}}, "The lower bound of X1 must be below the upper one, but they are 1 and 0.5"),
        ({"bounds": {"X1": 1.0}}, "Bounds of X1 must be a lower and an upper one"),
        ({"bounds": {"X1": (float("nan"), 1.0)}}, "Bounds of X1 must be numbers, or None for none"),
        ({"bounds": {"X1": (-2.0, -1.0)}}, "X1 must be at least 0, which leaves nothing between -2 and -1"),
        ({"fixed": {"X1": 0.04}, "bounds": {"X1": (0, 1)}}, "X1 must be fixed or bounded, but it is both"),
        ({"fixed": X}, "At least one parameter must be free"),
        (
            {"method": "iv", "bounds": {"X1": (0, 1)}},
            "'iv' knows no bounds. Those that do: filter_error, ",
        ),
        ({"method": "filtered", "tau": "auto", "fixed": {"X1": 0.04}}, "Give --tau T1,T2"),
    ],
)
def test_what_cannot_be_held_is_refused(options, message):
    with pytest.raises(Failure, match=message):
        identify(Model.default(), simulated(duration=1.0), **options)


def test_a_bound_of_a_parameter_that_enters_nonlinearly_is_refused_by_regressions():
    model = Model.default().with_effects(["drive_compliance"])
    name = find("drive_compliance").full_names[0]
    with pytest.raises(Failure, match=r"enters nonlinearly.*Bound it with filter_error or shooting, or fix it"):
        identify(model, simulated(duration=1.0), method="filtered", bounds={name: (1.0, 1000.0)})


def test_the_command_line_fixes_and_bounds(tmp_path):
    save_log(tmp_path / "log.csv", simulated(duration=4.0))
    (tmp_path / "model.toml").write_text(Model.default().text, encoding="utf-8")
    line = ["identify", tmp_path / "log.csv", "--model", tmp_path, "--method", "filtered"]
    data = json.loads(run(*line, "--fix", "X5=4.6", "--bound", "X1=0.2:", "--json", "-").stdout)
    assert data["fixed"] == ["X5"] and data["at_bounds"] == {"X1": 0.2}
    assert data["parameters"]["X5"] == {"value": 4.6, "sigma": 0.0, "identifiable": True}
    text = run(*line, "--fix", "X5=4.6", "--bound", "X1=0.2:").stdout.splitlines()
    (fixed,), (bounded,) = ([row for row in text if f" {name} " in f" {row} " and "V" in row] for name in ("X5", "X1"))
    assert "fixed" in fixed and "±" not in fixed and "at its bound" in bounded


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ("--fix X5", "--fix must be NAME=VALUE, such as X5=4.7, not 'X5'"),
        ("--fix X5=much", "--fix X5=much must give numbers, but 'much' is none"),
        ("--fix X5=1 --fix X5=2", "--fix must name each parameter once, but X5 is there twice"),
        ("--bound X1=1", "--bound must be NAME=LOW:HIGH"),
        ("--bound X1=:", "--bound must be NAME=LOW:HIGH"),
        ("--bound X1=0:one", "--bound X1=0:one must give numbers, but 'one' is none"),
    ],
)
def test_the_command_line_says_how_they_must_look(tmp_path, option, message):
    save_log(tmp_path / "log.csv", simulated(duration=1.0))
    result = run("identify", tmp_path / "log.csv", *option.split(), code=1)
    assert message in " ".join(result.stderr.split())


@pytest.mark.parametrize("method", [*LINEAR_METHODS, "iv"])
def test_the_covariance_of_a_regression_has_its_standard_errors(method):
    result = found(method)
    sigma = dict(zip(result.covariance.names, np.sqrt(np.diag(result.covariance.matrix)), strict=True))
    assert sigma == pytest.approx({n: e.sigma for n, e in result.parameters.items()}, rel=1e-9)
    correlation = result.covariance.matrix / np.outer([*sigma.values()], [*sigma.values()])
    assert np.all(np.abs(correlation) < 1.0 + 1e-9) and np.abs(correlation[0, 1]) > 0.1
    np.testing.assert_allclose(correlation, correlation.T, atol=1e-12)
