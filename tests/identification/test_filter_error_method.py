"""The filter-error method as `identify` uses it: complete models, missing laws, delays, gaps, sensors with errors."""

from dataclasses import replace

import numpy as np
import pytest

from derive import plants
from tests.plants.machines import LEVER, MACHINES, log_of, model_of
from tests.support import X, simulated
from wheelpend import Log, Model, identify, simulate

BARE = 'plant = "wheel_pendulum"\n[sensors]\nencoder_counts = 60000\n'
RECORD_BOUND = {"X1": 0.0505, "X2": 0.1235, "X3": 0.0254, "X4": 0.0126, "X5": 0.0135, "X7": 0.0084}  # %, of 20 s
NOISE = np.radians(0.5)  # rad and rad/s, of pitch and gyro


def deviations(found, truth=X):
    """Errors in standard errors, by name."""
    return {n: (found.parameters[n].value - v) / found.parameters[n].sigma for n, v in truth.items()}


def worst(found, truth=X):
    return max(map(abs, deviations(found, truth).values()))


def leaves_nothing_to_chance(found):
    return not found.remainder.force and not found.remainder.sensors and not found.remainder.places


@pytest.fixture(scope="module")
def complete():
    return identify(Model.default(), [simulated(seed=1)])


@pytest.mark.parametrize("seed", [1, 2])
def test_a_complete_model_needs_no_force_and_its_errors_are_the_records_bound(seed, complete):
    found = complete if seed == 1 else identify(Model.default(), [simulated(seed=seed)])
    assert found.method == "filter_error" and leaves_nothing_to_chance(found)
    assert worst(found) < 4.0
    for name, percent in RECORD_BOUND.items():
        assert 100 * found.parameters[name].sigma / X[name] == pytest.approx(percent, rel=0.1)
    assert found.error < 1.02 * found.noise_floor and not found.warnings


def nominal(values):
    return "[parameters]\n" + "\n".join(f"{n} = {{ nominal = {v} }}" for n, v in values.items())


@pytest.mark.parametrize("start", ["30 percent off", "half and double", "none"])
def test_wherever_it_starts_it_ends_at_the_same_values(start, complete):
    factors = {"30 percent off": (1.3, 0.7), "half and double": (2.0, 0.5), "none": None}[start]
    text = BARE + (nominal({n: v * factors[k % 2] for k, (n, v) in enumerate(X.items())}) if factors else "")
    found = identify(Model.parse(text), [simulated(seed=1)])
    assert leaves_nothing_to_chance(found)
    for name, row in found.parameters.items():
        assert row.value == pytest.approx(complete.parameters[name].value, abs=0.1 * row.sigma)


@pytest.fixture(scope="module")
def rubbing():
    return simulated(seed=1, coulomb_drive__torque=0.3)


@pytest.mark.slow
def test_friction_that_nobody_modelled_is_a_force_in_the_drive_and_does_not_bend_the_inertia(rubbing):
    found = identify(Model.default(), [rubbing])
    assert found.remainder.places == ("drive",) and not found.remainder.sensors
    assert {row: f.place for row, f in found.remainder.force.items()} == {"wheel": "drive", "body": "drive"}
    force = found.remainder.force["wheel"]
    assert 0.1 < force.rms < 0.25 and 0.02 < force.share_of_drive < 0.15 and 0.01 < force.correlation_time_s < 0.5
    assert force.rms == found.remainder.force["body"].rms
    assert abs(deviations(found)["X1"]) < 3.0 and 0.1 < found.parameters["X1"].value / X["X1"] < 3.0


@pytest.mark.slow
def test_a_force_may_be_of_another_size_in_each_log(rubbing):
    model, clean = Model.default(), simulated(seed=2)
    found = identify(model, [rubbing, clean])
    assert found.remainder.places == ("drive",)
    assert worst(found) < 4.0
    for name, percent in RECORD_BOUND.items():  # the clean log tells about as much as if it were alone
        assert 100 * found.parameters[name].sigma / X[name] < 3.0 * percent


@pytest.mark.parametrize(
    ("effect", "hidden"),
    [
        ("actuator_delay", {"delay": 0.006}),
        ("winding_inductance", {"time_constant": 0.02}),
        pytest.param("imu_lag", {"delay": 0.02}, marks=pytest.mark.slow),
        pytest.param("presliding_drive", {"torque": 0.3, "stiffness": 20.0}, marks=pytest.mark.slow),
    ],
)
def test_delays_lags_and_effects_with_states_are_found_without_a_force(effect, hidden):
    values = {f"{effect}.{n}": v for n, v in hidden.items()}
    log = simulate(Model.default(), command="aggressive", duration=20.0, seed=3, hide=values)
    found = identify(Model.default().with_effects([effect]), [log])
    assert leaves_nothing_to_chance(found)
    assert worst(found, X | values) < 4.0
    assert all(found.parameters[n].sigma < 0.01 * v for n, v in values.items())


def test_gaps_missing_cells_and_a_slow_gyro_are_no_force():
    log, random = simulated(seed=2), np.random.default_rng(0)
    measured, kept = log.measured.copy(), np.r_[:9000, 10500 : len(log)]
    measured[random.random(measured.shape) < 0.05] = np.nan
    measured[np.arange(len(log)) % 10 != 0, 2] = np.nan
    cut = replace(log, t=log.t[kept], voltage=log.voltage[kept], measured=measured[kept], reference=None)
    found = identify(Model.default(), [cut])
    assert leaves_nothing_to_chance(found)
    assert worst(found) < 4.0 and found.parameters["X1"].sigma < 0.01 * X["X1"]


def test_the_input_of_a_gap_is_not_made_up():
    log = simulated(seed=2)
    kept = np.r_[:9000, 10500 : len(log)]
    cut = replace(log, t=log.t[kept], voltage=log.voltage[kept], measured=log.measured[kept], reference=None)
    found = identify(Model.default(), [cut])
    assert leaves_nothing_to_chance(found) and worst(found) < 4.0
    assert 100 * found.parameters["X1"].sigma / X["X1"] == pytest.approx(RECORD_BOUND["X1"], rel=0.15)
    assert found.error < 1.02 * found.noise_floor


# -- sensors with errors of their own


def smoothed(signal, time, dt):
    """A signal behind a first-order low-pass filter."""
    found, decay = signal.copy(), np.exp(-dt / time)
    for k in range(1, len(signal)):
        found[k] = decay * found[k - 1] + (1 - decay) * signal[k]
    return found


def filtered_pitch(seed):
    """The pitch behind a filter of 20 ms, noise added afterwards."""
    log = simulated(seed=seed, noise=False)
    random, measured = np.random.default_rng(seed), log.measured.copy()
    measured[:, 0] = np.round(measured[:, 0] * 60000 / 2 / np.pi) * 2 * np.pi / 60000
    measured[:, 1] = smoothed(measured[:, 1], 0.02, log.dt)
    measured[:, 1:] += NOISE * random.normal(size=(len(log), 2))
    return replace(log, measured=measured)


def fused_pitch(seed):
    """The pitch from a complementary filter of 0.5 s between the gyro and the angle of a noisy accelerometer."""
    log = simulated(seed=seed, noise=False)
    random, measured = np.random.default_rng(seed + 100), log.measured.copy()
    measured[:, 0] = np.round(measured[:, 0] * 60000 / 2 / np.pi) * 2 * np.pi / 60000
    measured[:, 2] += NOISE * random.normal(size=len(log))
    level = measured[:, 1] + 4 * NOISE * random.normal(size=len(log))
    decay = np.exp(-log.dt / 0.5)
    for k in range(1, len(log)):
        turned = measured[k - 1, 1] + measured[k, 2] * log.dt
        measured[k, 1] = decay * turned + (1 - decay) * level[k]
    return replace(log, measured=measured)


def drifting_gyro(seed):
    """A gyro whose zero walks at random, by half a degree a second in one second."""
    log = simulated(seed=seed)
    walk = np.cumsum(np.random.default_rng(seed + 100).normal(size=len(log))) * NOISE * np.sqrt(log.dt)
    return replace(log, measured=log.measured + walk[:, None] * [0.0, 0.0, 1.0])


@pytest.mark.slow
@pytest.mark.parametrize(("recorded", "channel"), [(fused_pitch, "theta_p"), (drifting_gyro, "dtheta_p")])
@pytest.mark.parametrize("seed", [1, 2])
def test_what_a_sensor_gets_wrong_is_no_force(recorded, channel, seed):
    found = identify(Model.default(), [recorded(seed)])
    assert not found.remainder.force and set(found.remainder.sensors) == {channel}
    assert 0.5 < found.remainder.sensors[channel].sigmas < 5.0
    assert found.remainder.sensors[channel].correlation_time_s <= 1.0
    assert worst(found) < 4.0 and found.parameters["X1"].sigma < 0.005 * X["X1"]


def pitch_filtered_with_its_noise(seed):
    """The pitch behind a filter of 20 ms, noise and all; the controller saw it before the filter."""
    log = simulated(seed=seed)
    pitch = smoothed(log.measured[:, 1], 0.02, log.dt)
    return replace(log, measured=np.column_stack([log.measured[:, 0], pitch, log.measured[:, 2]]))


@pytest.mark.slow
@pytest.mark.parametrize("recorded", [filtered_pitch, pitch_filtered_with_its_noise])
@pytest.mark.parametrize("seed", [1, 6])
def test_a_filter_of_the_pitch_is_a_lag_of_its_time_and_no_force(recorded, seed):
    found = identify(Model.default(), [recorded(seed)])
    assert not found.remainder.force and set(found.remainder.sensors) == {"theta_p"}
    error = found.remainder.sensors["theta_p"]
    assert error.lag_s == pytest.approx(0.02, rel=0.05)
    assert error.sigmas < 0.1  # what the lag does not account for: nothing
    assert worst(found) < 4.0 and found.parameters["X1"].sigma < 0.002 * X["X1"]


# -- every plant


SLOW = [m for m in MACHINES if m not in ("slide", "cart_pole", LEVER)]


@pytest.mark.parametrize(
    "machine", ["slide", "cart_pole", LEVER, *(pytest.param(m, marks=pytest.mark.slow) for m in SLOW)]
)
def test_every_plant_is_identified_without_a_force(machine):
    model = model_of(machine)  # which makes a user's plant known
    truth = MACHINES[machine].values or plants.reference_of(MACHINES[machine].plant)
    found = identify(model, [log_of(machine)])
    assert leaves_nothing_to_chance(found)
    assert worst(found, truth) < 5.0


def test_an_inertia_that_no_sample_shows_is_not_known_by_where_the_integrator_becomes_unstable():
    t = np.arange(220) * 0.1  # a motor that reaches its speed within a few milliseconds
    volts = 1.2 * np.floor(t / 3.0)
    way = np.cumsum(np.r_[0.0, (volts / 570.0 * 0.1)[:-1]]) + 2e-5 * np.random.default_rng(4).standard_normal(220)
    log = Log("staircase", t, volts, (1e-4 * np.round(way / 1e-4))[:, None], ("x",), rates={})
    model = Model.parse('plant = "slide"\neffects = ["viscous_drive"]\n[sensors.step]\nx = 0.0001\n')
    found = identify(model, [log])
    mass, friction = found.parameters["X1"], found.parameters["viscous_drive.coefficient"]
    assert friction.value == pytest.approx(570.0, rel=0.01) and friction.sigma < 0.01 * friction.value
    assert not mass.identifiable or mass.sigma > 0.5 * mass.value
    assert np.isfinite(found.error) and found.error < 3.0
