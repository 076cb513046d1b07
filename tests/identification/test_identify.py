"""Identification recovers what was planted, from good starts, bad ones and none."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support import X, simulated
from wheelpend import Failure, Log, Model, identify, simulate
from wheelpend.benchmarks.hidden_effects.engine import engine_log

BARE = 'plant = "wheel_pendulum"\n[sensors]\nencoder_counts = 60000\n'


def deviations(result):
    """Errors in standard errors."""
    return np.array([(row.value - X[n]) / row.sigma for n, row in result.parameters.items()])


def test_shooting_reaches_the_cramer_rao_bound_of_its_own_problem():
    squares = [
        deviations(identify(Model.default(), [simulated(seed=seed, duration=6.0)], method="shooting")) ** 2
        for seed in range(12)
    ]
    assert np.all(np.sqrt(np.mean(squares, axis=0)) < 1.5)
    assert np.all(np.sqrt(np.mean(squares, axis=0)) > 0.55)  # nor are the standard errors too large
    assert 0.7 < np.sqrt(np.mean(squares)) < 1.2


def test_shooting_starts_from_nothing():
    result = identify(Model.parse(BARE), [simulated()], method="shooting")
    assert np.abs(deviations(result)).max() < 4.5
    assert result.error < 1.02 * result.noise_floor


def test_shooting_starts_from_parameters_30_percent_off():
    lines = [f"{n} = {{ nominal = {v * (0.7 if k % 2 else 1.3)} }}" for k, (n, v) in enumerate(X.items())]
    result = identify(Model.parse(BARE + "[parameters]\n" + "\n".join(lines)), [simulated()], method="shooting")
    assert np.abs(deviations(result)).max() < 4.5


def test_shooting_identifies_a_robot_of_another_size():
    small = {"X1": 0.004, "X2": 0.002, "X3": 0.006, "X4": 0.02, "X5": 0.5, "X6": 0.3, "X7": 0.299}
    machine = "[controller]\nkind = 'pid'\ngains = [-40.0, -100.0, -2.0]\n[simulation]\n" + "".join(
        f"{n} = {v}\n" for n, v in small.items()
    )
    result = identify(
        Model.parse(BARE), [simulate(Model.parse(BARE + machine), command="aggressive", seed=1)], method="shooting"
    )
    assert all(abs(row.value - small[n]) < 5 * row.sigma for n, row in result.parameters.items())


def test_the_filtered_method_is_exact_on_ideal_data():
    result = identify(Model.default(), [simulated(noise=False)], method="filtered", tau=(0.14, 0.14), test_bias=False)
    assert all(abs(row.value / X[n] - 1) < 0.01 for n, row in result.parameters.items())


LAGGING = {"winding_inductance.time_constant": 0.02}


@pytest.mark.slow
def test_shooting_is_exact_on_ideal_data_however_the_input_lags():
    model = Model.default()
    for lagging, log in ((model, simulated(noise=False, duration=4.0)),
                         (model.with_effects(["winding_inductance"]),
                          simulate(model, hide=LAGGING, noise=False, duration=4.0))):  # fmt: skip
        result = identify(lagging, [log], method="shooting")
        truth = X | LAGGING
        assert all(abs(row.value / truth[n] - 1) < 1e-6 for n, row in result.parameters.items())


@pytest.mark.parametrize("method", ["filtered", "iv", "energy"])
def test_a_regression_sees_the_input_that_acts_where_it_lags(method):
    model, tau = Model.default(), (0.3, 0.5) if method != "energy" else None
    log = simulate(model, hide=LAGGING, noise=False, duration=10.0)
    known = model.with_effects(["winding_inductance"]).with_fit({n: (v, 1e-6) for n, v in LAGGING.items()})
    aware, unaware = (identify(m, [log], method=method, tau=tau, test_bias=False) for m in (known, model))
    assert all(abs(row.value / X[n] - 1) < 0.03 for n, row in aware.parameters.items())
    assert max(abs(row.value / X[n] - 1) for n, row in unaware.parameters.items()) > 0.5


def test_differentiation_is_badly_biased_on_noisy_data():
    result = identify(Model.default(), [simulated()], method="differentiation", test_bias=False)
    assert abs(result.parameters["X4"].value / X["X4"] - 1) > 0.5


def test_an_unknown_method_lists_the_known_ones():
    with pytest.raises(Failure, match="filter_error, shooting, filtered, iv, recursive, energy"):
        identify(Model.default(), [simulated()], method="shoting")


def test_a_robot_that_stands_still_names_what_its_log_never_excites():
    log = simulated(command="upright", duration=5.0, noise=False)
    still = type(log)("still.csv", log.t, np.full_like(log.voltage, 1e-9), np.zeros_like(log.measured), log.channels)
    with pytest.raises(Failure):
        identify(Model.parse(BARE), [still])


@pytest.mark.parametrize(
    ("effect", "hidden"),
    [
        pytest.param("stribeck_drive", {"static": 0.5, "sliding": 0.2, "speed": 0.5}, marks=pytest.mark.slow),
        ("voltage_saturation", {"limit": 10.0}),
    ],
)
def test_an_effect_that_is_only_named_is_fitted_from_where_the_log_says(effect, hidden):
    log = simulated(seed=4, duration=12.0, **{f"{effect}__{name}": value for name, value in hidden.items()})
    found = identify(Model.default().with_effects([effect]), [log]).parameters
    for name, truth in hidden.items():
        assert found[f"{effect}.{name}"].value == pytest.approx(truth, rel=0.02)


def test_a_fit_far_above_the_noise_says_that_its_values_mean_nothing():
    log = simulated(duration=6.0)
    assert not any("times the noise" in w for w in identify(Model.default(), [log], method="shooting").warnings)
    turned = replace(log, voltage=log.voltage[::-1].copy())
    found = identify(Model.default(), [turned], method="shooting")
    assert found.error > 3.0 * found.noise_floor
    said = [w for w in found.to_json()["warnings"] if "times the noise" in w]
    assert len(said) == 1
    assert "mean nothing yet. Run `wheelpend diagnose`" in said[0]


@pytest.mark.slow
@pytest.mark.extras
def test_a_fit_that_has_not_arrived_is_begun_again():
    pytest.importorskip("mujoco")
    log = engine_log({}, command="simple", seed=5017)  # its first fit stops underway, at 1.064
    assert identify(Model.default(), [log]).error < 1.01


@pytest.mark.slow
@pytest.mark.parametrize("method", ["filter_error", "shooting"])
def test_a_delay_shows_in_logs_that_begin_with_their_step(method):
    nominal = "[parameters]\nX1 = { nominal = 0.02 }\nX2 = { nominal = 0.2 }\n"
    model = Model.parse('plant = "shaft"\neffects = ["actuator_delay"]\n' + nominal)
    t, logs = 0.01 * np.arange(200), []
    for volts, seed in ((3.0, 1), (6.0, 2)):
        since = np.maximum(t - 0.035, 0.0)  # a step at 0, felt 35 ms later by a motor of 0.1 s
        angle = volts / 0.2 * (since - 0.1 * (1.0 - np.exp(-since / 0.1)))
        angle += 1e-3 * np.random.default_rng(seed).standard_normal(t.size)
        logs.append(Log.from_arrays(t, table=model.table, v_in=np.full(t.size, volts), theta_m=angle))
    found = identify(model, logs, method=method).parameters
    assert found["actuator_delay.delay"].value == pytest.approx(0.035, abs=0.002)
    assert found["actuator_delay.delay"].sigma < 0.01 and found["X1"].value == pytest.approx(0.02, rel=0.05)
