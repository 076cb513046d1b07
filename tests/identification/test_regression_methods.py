"""Other ways to identify: instruments, recursion, energy; whether least squares is biased; which filters to take."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support import X, simulated
from wheelpend import Failure, Model, identify, simulate
from wheelpend.estimation.least_squares import filtered_least_squares, measured_states
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.identification.energy import energy_limit
from wheelpend.identification.recursive import recursive_least_squares
from wheelpend.identification.time_constants import save_error_maps, time_constant_pairs

TRUE = np.array(list(X.values()))


def values(result):
    return np.array([row.value for row in result.parameters.values()])


def sigmas(result):
    return np.array([row.sigma for row in result.parameters.values()])


def quiet(share, **options):
    """A log with so much of the paper's noise."""
    model = Model.default()
    machine = {n: v * share if "noise" in n else v for n, v in model.simulation.items()}
    return simulate(replace(model, simulation=machine), **options)


def known(module, log):
    return kernel_parameters(module, X, log)


# ---- instrumental variables


def test_instruments_remove_the_bias_of_filtered_regression():
    errors = {m: [] for m in ("iv", "filtered")}
    for seed in range(4):
        for method, found in errors.items():
            result = identify(Model.default(), [simulated(seed=seed)], method=method, test_bias=False)
            found.append(values(result) / TRUE - 1)
    worst = {m: np.abs(e).max(axis=0)[3:5] for m, e in errors.items()}  # X4, X5
    assert np.all(worst["iv"] < 0.02) and np.all(worst["iv"] < 0.1 * worst["filtered"])


@pytest.mark.slow
def test_the_standard_errors_of_instruments_hold_though_filters_colour_the_residual():
    results = [identify(Model.default(), [simulated(seed=s)], method="iv") for s in range(8)]
    deviations = np.array([(values(r) - TRUE) / sigmas(r) for r in results])
    assert np.abs(deviations).max() < 4
    assert np.all(np.sqrt(np.mean(deviations**2, axis=0)) < 2)


def test_instruments_come_to_the_same_from_a_model_without_values():
    bare = replace(Model.default(), parameters={})
    with_values = identify(Model.default(), [simulated()], method="iv")
    without = identify(bare, [simulated()], method="iv")
    assert np.all(np.abs(values(without) - values(with_values)) < 0.05 * sigmas(with_values))


def test_instruments_need_the_controller():
    with pytest.raises(Failure, match=r"the controller must be known .* no \[controller\]"):
        identify(replace(Model.default(), controller=None), [simulated()], method="iv")


def test_instruments_need_the_reference():
    with pytest.raises(Failure, match="theta_ref at every sample"):
        identify(Model.default(), [replace(simulated(), reference=None)], method="iv")


def test_instruments_refuse_gains_under_which_the_robot_falls():
    wrong = replace(Model.default().controller, gains=(5.0, 0.0, 0.0))
    with pytest.raises(Failure, match=r"the robot fell .* Check the gains"):
        identify(replace(Model.default(), controller=wrong), [simulated(duration=5.0)], method="iv")


# ---- recursion


@pytest.mark.parametrize("first_order", [False, True])
def test_recursion_ends_where_least_squares_over_the_whole_log_does(lean, first_order):
    log, tau = simulated(), (0.5, 1.0)
    start = measured_states(lean, log)[0]
    batch = filtered_least_squares(lean, log, known(lean, log), tau, first_order_hold=first_order, start=start)
    found = recursive_least_squares(lean, log, known(lean, log), tau, first_order_hold=first_order)
    assert np.allclose(found.fit.estimate, batch.estimate, rtol=1e-6, atol=0)
    assert found.track[-1].t == log.t[-1] and [*found.track[-1].parameters.values()] == [*found.fit.estimate]


def test_a_forgetting_factor_follows_a_parameter_that_changes(lean):
    log = simulated(noise=False, command="simple")
    weak = replace(log, voltage=np.where(log.t < 10, log.voltage, 2 * log.voltage))  # every X doubles at half time
    found = [recursive_least_squares(lean, weak, known(lean, log), (0.1, 0.1), forgetting=f, first_order_hold=True).fit
             for f in (1.0, 0.999)]  # fmt: skip
    errors = [abs(f.values["X6"] / (2 * X["X6"]) - 1) for f in found]
    assert errors[1] < 0.02 < errors[0]


# ---- energy


def test_integrated_energy_identifies_on_ideal_data_but_for_what_rounds_the_wheels_rate():
    error = np.abs(
        values(identify(Model.default(), [simulated(noise=False)], method="energy", test_bias=False)) / TRUE - 1
    )
    assert error.max() < 0.02 and np.all(error[[3, 4, 5, 6]] < 1e-3)


def test_integration_is_the_limit_of_slow_filters(lean):
    log = simulated(noise=False)
    taus = log.duration * np.array([1e-1, 1e1, 1e4])
    behind, integrated = energy_limit(lean, log, known(lean, log), taus)
    distance = np.abs(behind / integrated - 1).max(axis=1)
    assert distance[2] < 1e-3 and np.all(np.diff(distance) < 0)


# ---- bias


def test_least_squares_is_biased_on_the_papers_noise_by_as_much_as_the_rehearsal_says():
    bias = identify(Model.default(), [simulated(seed=5)], method="filtered").bias
    assert bias.biased and bias.p_value < 1e-4 and bias.against == "iv"
    for name in ("X4", "X5"):
        gap = bias.difference_percent[name] - bias.predicted_bias_percent[name]
        assert abs(gap) < 4 * bias.sigma_percent[name]


def test_least_squares_is_not_biased_on_a_nearly_noise_free_log():
    bias = identify(Model.default(), [quiet(1e-3, seed=6)], method="filtered").bias
    assert not bias.biased and bias.p_value > 0.05


def test_the_bias_shows_without_a_controller_too():
    bare = replace(Model.default(), controller=None)
    bias = identify(bare, [simulated(seed=7, duration=10.0)], method="filtered").bias
    assert bias.biased and bias.against == "shooting"


@pytest.mark.slow
def test_the_papers_hold_is_itself_a_bias_where_noise_is_none():
    holds = {h: identify(Model.default(), [quiet(1e-3, seed=8)], method="recursive", hold=h) for h in ("zero", "first")}
    assert holds["zero"].bias.biased and not holds["first"].bias.biased


# ---- time constants


@pytest.mark.slow
def test_fast_filters_are_chosen_where_there_is_hardly_noise():
    result = identify(Model.default(), [quiet(1e-3, seed=9)], method="filtered", tau="auto", test_bias=False)
    assert result.tau == result.guide.chosen and result.tau[0] < 1.0
    assert np.abs(values(result) / TRUE - 1).max() < 0.002
    assert "through bias" in result.guide.reason and f"{result.tau[0]:g}" in result.guide.reason


@pytest.mark.slow
def test_the_guide_says_what_more_seeds_confirm(tmp_path):
    log = simulated(seed=10)
    result = identify(Model.default(), [log], method="filtered", tau="auto", test_bias=False)
    others = [identify(Model.default(), [simulated(seed=s)], method="filtered", tau=result.tau, test_bias=False)
              for s in range(11, 17)]  # fmt: skip
    found = 100 * (np.mean([values(o) for o in others], axis=0) / TRUE - 1)
    row = result.guide.pair(result.tau)
    assert abs(found[3] - row.bias_percent["X4"]) < 3 and abs(found[4] - row.bias_percent["X5"]) < 3
    assert [r.tau1 for r in result.guide.diagonal] == sorted({t for pair in time_constant_pairs(log) for t in pair})
    save_error_maps(result.guide, tmp_path / "map.png")
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")


# ---- settings


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"method": "filtered", "tau": (0.1,)}, "takes two time constants in s, but 1 came"),
        ({"method": "energy", "tau": (0.1, 0.2)}, "takes one time constant in s, but 2 came"),
        ({"method": "filtered", "tau": (0.1, -1.0)}, "must be positive and finite, in s, not 0.1, -1"),
        ({"method": "energy", "tau": "auto"}, "cannot be chosen with auto"),
        ({"method": "filtered", "hold": "second"}, "No hold named 'second'. Known holds: zero, first"),
        ({"method": "recursive", "forgetting": 1.5}, "at least 0.5 and at most 1, not 1.5"),
    ],
)
def test_settings_that_cannot_be_are_refused(settings, message):
    with pytest.raises(Failure, match=message):
        identify(Model.default(), [simulated()], **settings)


def test_settings_that_a_method_does_not_use_are_said():
    result = identify(Model.default(), [simulated()], method="differentiation", tau=(0.1, 0.1), test_bias=False)
    assert "--tau is not used by the method 'differentiation'." in result.warnings
