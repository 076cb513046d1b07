"""The filter of a machine that sticks and slips, against a particle filter and numerical quadrature."""

import math

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose
from scipy.integrate import quad
from scipy.stats import norm

from templates.core.frame import BY_VARIABLE, PUSH, WEIGHT
from templates.core.merging import _reduce_parts
from templates.core.mixture import _empty_mixture, _split_parts
from templates.core.truncated import _piece, _shrunk
from tests.support import X, simulated
from wheelpend import Model
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.kernels.load import free_force_module
from wheelpend.logs.log import Log

DT, NOISE, MASS, DRAG, FORCE = 0.005, 2e-5, 2.7, 5.8, 0.15
MACHINES = {  # friction, correlation time of the force, amplitude of the drive, and the seed of the force
    "some_sticking": (0.3, 0.1, 0.6, 3),
    "much_sticking": (0.3, 0.1, 0.3, 3),
    "slow_force": (0.3, 0.5, 0.5, 3),
    "small_friction": (0.1, 0.1, 0.4, 4),
    "a_stop_in_the_tail": (0.6, 0.1, 0.9, 3),  # a force of 3 standard deviations just where the axis stops
}
NATS_SHORT = dict.fromkeys(MACHINES, 1.0) | {
    "a_stop_in_the_tail": 10.0
}  # at most, per 1000 samples: five parts have short tails
ROBOT_SIGMA = np.array([2 * math.pi / 60000 / math.sqrt(12.0), 0.5 * math.pi / 180, 0.5 * math.pi / 180])
SLIDE = f'plant = "slide"\neffects = []\n[sensors.noise]\nx = {NOISE}\n'


@njit
def axis_step(x, v, drive, friction, dt):
    """A mass with drag and dry friction over a time, by implicit time stepping: position and speed."""
    decay = math.exp(-DRAG / MASS * dt)
    gain = (1.0 - decay) / DRAG
    slip = decay * v + gain * drive
    taken = min(max(slip, -gain * friction), gain * friction)
    x += gain * MASS * v + (dt - gain * MASS) / DRAG * (drive - taken / gain)
    return x, slip - taken


@njit
def axis(drive, friction, time, seed):
    """Positions and speeds (N, 2) under a random force, in steps forty times as fine as the samples."""
    np.random.seed(seed)
    states, decay = np.zeros((drive.size, 2)), math.exp(-DT / time)
    x, v, force = 0.0, 0.0, FORCE * np.random.randn()
    for k in range(drive.size):
        states[k, 0], states[k, 1] = x, v
        for _ in range(40):
            x, v = axis_step(x, v, drive[k] + force, friction, DT / 40)
        force = decay * force + FORCE * math.sqrt(1.0 - decay**2) * np.random.randn()
    return states


@njit
def particle_filter(drive, x_measured, friction, time, count, seed):
    """Log-likelihood of positions from the second on (Gordon, Salmond and Smith 1993, systematic resampling)."""
    np.random.seed(seed)
    decay, total = math.exp(-DT / time), 0.0
    x, v, force = x_measured[0] + NOISE * np.random.randn(count), np.zeros(count), FORCE * np.random.randn(count)
    log_weight, kept = np.zeros(count), np.zeros(count, np.int64)
    for k in range(1, drive.size):
        for i in range(count):
            x[i], v[i] = axis_step(x[i], v[i], drive[k - 1] + force[i], friction, DT)
            force[i] = decay * force[i] + FORCE * math.sqrt(1.0 - decay**2) * np.random.randn()
            log_weight[i] = -0.5 * ((x_measured[k] - x[i]) / NOISE) ** 2
        largest = log_weight.max()
        share = np.cumsum(np.exp(log_weight - largest))
        total += largest + math.log(share[-1] / count) - math.log(NOISE * math.sqrt(2.0 * math.pi))
        place, j = np.random.rand(), 0
        for i in range(count):
            while share[j] * count < (place + i) * share[-1] and j < count - 1:
                j += 1
            kept[i] = j
        x, v, force = x[kept], v[kept], force[kept]
    return total


def machine(name, samples=4000):
    """Drive, log and module of a machine."""
    friction, _, amplitude, seed = MACHINES[name]
    t = np.arange(samples) * DT
    drive = amplitude * np.sin(2 * np.pi * t / 1.3) + 0.2 * amplitude * np.sin(2 * np.pi * t / 0.41)
    x = axis(drive, friction, MACHINES[name][1], seed)[:, :1] + NOISE * np.random.default_rng(0).normal(
        size=(samples, 1)
    )
    model = Model.parse(SLIDE)
    module = free_force_module(model.plant, model.assumptions, ["viscous_drive", "coulomb_drive"])
    return module, Log("axis", t, drive, x, ("x",), range_channel="", rates={})


def run_filter(module, log, time, values, names=(), parts=5):
    """Gram matrix, log-likelihood from the second sample on, and filtered variances of the speed (steps,)."""
    values = {"X1": MASS, "viscous_drive.coefficient": DRAG, **values}
    columns = np.array([module.PARAMETERS.index(n) for n in names], dtype=np.int64)
    forces = np.array([module.PARAMETERS.index(n) for n in module.MISSING_FORCES])
    steps, gram, log_det = 2 * len(log), np.zeros((1, columns.size + 1, columns.size + 1)), np.zeros(1)
    innovation = np.full((len(log), 1, 2), np.nan)
    track = np.zeros((steps, 2, 3)), np.zeros((steps, 2, 3, 3)), np.zeros((steps, 3, 3)), np.zeros(steps, np.int64)
    done = module.filter_error(
        log.t, log.voltage, log.measured, np.array([1 / NOISE]), np.array([[0, len(log)]]),
        np.array([[log.measured[0, 0], 0.0]]), np.array([NOISE, 1e-7]), kernel_parameters(module, values, log), columns,
        forces, np.eye(1), np.zeros((1, 1)), np.array([[FORCE, time, 0.0]]), DT, parts, gram, log_det,
        innovation, *track,
    )  # fmt: skip
    innovations = innovation[1:, 0]
    deviance = np.sum(innovations[:, 0] ** 2 + innovations[:, 1]) + 2 * (len(log) - 1) * math.log(
        NOISE * math.sqrt(2 * math.pi)
    )
    assert_allclose(gram[0, -1, -1] + log_det[0], np.sum(innovation[:, 0, 0] ** 2 + innovation[:, 0, 1]), rtol=1e-9)
    return gram[0], -0.5 * deviance, track[1][:done, 1, 1, 1]


@pytest.mark.slow
@pytest.mark.parametrize("name", MACHINES)
def test_the_likelihood_is_a_particle_filter_s_within_a_nat_per_thousand_samples(name):
    module, log = machine(name)
    friction, time, *_ = MACHINES[name]
    _, likelihood, _ = run_filter(module, log, time, {"coulomb_drive.torque": friction})
    particles = [particle_filter(log.voltage, log.measured[:, 0], friction, time, 20000, seed) for seed in (1, 2)]
    reference = np.logaddexp(*particles) - math.log(2.0)  # the likelihoods, not their logarithms, are without bias
    assert -NATS_SHORT[name] < (likelihood - reference) / len(log) * 1000 < 1.0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["some_sticking", "much_sticking"])
def test_the_likeliest_friction_is_a_particle_filter_s_within_a_standard_error(name):
    module, log = machine(name)
    friction, time, *_ = MACHINES[name]
    tried = friction * np.linspace(0.8, 1.2, 5)
    own = [run_filter(module, log, time, {"coulomb_drive.torque": f})[1] for f in tried]
    particles = [particle_filter(log.voltage, log.measured[:, 0], f, time, 20000, 1) for f in tried]
    fits = [np.polyfit(tried, likelihoods, 2) for likelihoods in (own, particles)]
    (found, _), (reference, error) = [(-f[1] / f[0] / 2, (-2 * f[0]) ** -0.5) for f in fits]
    assert abs(found - reference) < error
    assert 0.5 * error < (-2 * fits[0][0]) ** -0.5 < 2 * error


@pytest.mark.slow
def test_the_score_of_friction_leads_to_its_likeliest_value():
    module, log = machine("some_sticking", 2000)
    friction, start = "coulomb_drive.torque", 0.2
    gram, before, _ = run_filter(module, log, 0.1, {friction: start}, [friction])
    step, error = gram[0, 1] / gram[0, 0], gram[0, 0] ** -0.5
    assert 3 * error < step < 12 * error
    assert 5 < run_filter(module, log, 0.1, {friction: start + step})[1] - before < 200


def test_a_surface_that_sticks_hears_the_encoder():
    module, log = machine("much_sticking", 1500)
    _, _, variances = run_filter(module, log, 0.1, {"coulomb_drive.torque": 0.3})
    _, _, deaf = run_filter(module, log, 0.1, {"coulomb_drive.torque": 3.0})
    assert 1e-6 < np.sqrt(np.median(variances[100:])) < 1e-3  # m/s
    assert np.median(deaf[100:]) < 1e-18


def test_friction_of_size_zero_changes_nothing():
    module, log = machine("some_sticking", 300)
    model = Model.parse(SLIDE)
    bare = free_force_module(model.plant, model.assumptions, ["viscous_drive"])
    with_zero, without = run_filter(module, log, 0.1, {"coulomb_drive.torque": 0.0}), run_filter(bare, log, 0.1, {})
    assert with_zero[1] == without[1]


@pytest.mark.parametrize(("mean", "sigma", "width"), [(0.3, 1.0, 0.5), (-2.0, 0.7, 1.5), (0.1, 0.2, 0.4)])
def test_what_friction_leaves_of_a_gaussian_has_the_moments_of_its_quadrature(mean, sigma, width):
    def average(function):
        return quad(
            lambda s: function(s) * norm.pdf(s, mean, sigma), mean - 9 * sigma, mean + 9 * sigma, points=[-width, width]
        )[0]

    left, share, signed, lost = _shrunk(mean, sigma, width)
    shrunk = lambda s: s - np.clip(s, -width, width)  # noqa: E731
    assert_allclose(left, average(shrunk), atol=1e-7)
    assert_allclose(
        [share, signed], [average(lambda s: abs(s) > width), average(lambda s: np.sign(shrunk(s)))], atol=1e-6
    )
    assert_allclose(lost, average(lambda s: (shrunk(s) - left) ** 2) - (share * sigma) ** 2, atol=1e-6)


@pytest.mark.parametrize("bounds", [(-0.5, 0.5), (0.5, math.inf), (-math.inf, -0.5), (2.0, 3.0)])
def test_a_piece_of_a_gaussian_has_the_moments_of_its_quadrature(bounds):
    low, high = max(bounds[0], -9.0), min(bounds[1], 9.0)
    powers = [quad(lambda s: s**k * norm.pdf(s), low, high)[0] for k in range(3)]  # noqa: B023
    at_low, at_high = norm.pdf(bounds[0]), norm.pdf(bounds[1])
    bent = low * at_low - high * at_high
    shift, spread = _piece(powers[0], at_low, at_high, bent)
    middle = powers[1] / powers[0]
    assert_allclose([shift, spread], [middle, powers[2] / powers[0] - middle**2], rtol=1e-5, atol=1e-9)


def test_cutting_keeps_the_mean_of_a_force_and_stops_what_sticks():
    mixture, costs, rays = _empty_mixture(5, 3)
    mixture[0, WEIGHT, 3], mixture[0, :3, :3] = 1.0, np.array([[1.0, 0.2, 0.1], [0.2, 1.0, 0.5], [0.1, 0.5, 2.0]])
    rays[BY_VARIABLE], rays[PUSH] = [0.0, 1.0, 0.0], [0.1, 1.0, 0.0]
    slip, width = 0.4, 0.8
    parts, left, share, signed = _split_parts(1, slip, width, rays, mixture, costs)
    assert parts == 3
    assert_allclose([left, share, signed], _shrunk(slip, 1.0, width)[:3], rtol=1e-12)
    weights, offsets = mixture[:3, WEIGHT, 3], mixture[:3, 3, :3]
    assert_allclose(weights.sum(), 1.0)
    assert_allclose(weights @ offsets, 0.0, atol=1e-9)  # of what friction leaves on the average
    assert_allclose(left + offsets[0, 1], 0.0, atol=1e-12)  # the part that sticks
    assert_allclose(mixture[0, 1, :3], 0.0, atol=1e-12)


def test_merging_keeps_mean_and_covariance():
    mixture, costs, _ = _empty_mixture(5, 2)
    rng = np.random.default_rng(5)
    count = 9
    mixture[:count, WEIGHT, 2], mixture[:count, 2, :2] = rng.dirichlet(np.ones(count)), rng.normal(size=(count, 2))
    mixture[:count, :2, :2] = [a @ a.T + 0.1 * np.eye(2) for a in rng.normal(size=(count, 2, 2))]

    def moments(parts):
        w, o, s = mixture[:parts, WEIGHT, 2], mixture[:parts, 2, :2], mixture[:parts, :2, :2]
        return w @ o, np.einsum("p,pab->ab", w, s + o[:, :, None] * o[:, None, :]), w.sum()

    before = moments(count)
    parts = _reduce_parts(count, 5, mixture, costs)
    assert parts == 5
    for one, other in zip(before, moments(parts), strict=True):
        assert_allclose(one, other, rtol=1e-9)


def test_one_part_where_nothing_may_stick_and_five_have_the_same_likelihood():
    module, log = machine("some_sticking", 300)
    small = {"coulomb_drive.torque": 1e-9}
    assert run_filter(module, log, 0.1, small, parts=1)[1] == pytest.approx(
        run_filter(module, log, 0.1, small)[1], abs=1e-3
    )


def test_five_parts_tell_more_of_what_sticks_than_one():
    module, log = machine("much_sticking", 1500)
    friction = {"coulomb_drive.torque": 0.3}
    assert 20 < run_filter(module, log, 0.1, friction)[1] - run_filter(module, log, 0.1, friction, parts=1)[1] < 500


def two_surfaces(parts):
    """−2 log-likelihood of a robot that rubs at its drive and on the floor, least variance, and innovations."""
    friction = {"coulomb_drive.torque": 0.4, "rolling_resistance.torque": 0.3}
    log = simulated(duration=3.0, coulomb_drive__torque=0.4, rolling_resistance__torque=0.3)
    model = Model.default()
    module = free_force_module(model.plant, model.assumptions, ["coulomb_drive", "rolling_resistance"])
    assert module.SURFACES == 2
    columns = np.array([module.PARAMETERS.index(n) for n in friction])
    forces = np.array([module.PARAMETERS.index(n) for n in module.MISSING_FORCES])
    steps, gram, log_det = 2 * len(log), np.zeros((1, 3, 3)), np.zeros(1)
    innovation = np.full((len(log), 3, 2), np.nan)
    track = np.zeros((steps, 2, 5)), np.zeros((steps, 2, 5, 5)), np.zeros((steps, 5, 5)), np.zeros(steps, int)
    done = module.filter_error(
        log.t, log.voltage, log.measured, 1.0 / ROBOT_SIGMA, np.array([[0, len(log)]]),
        np.array([[*log.measured[0, :2], 0.0, 0.0]]), np.full(4, 0.1),
        kernel_parameters(module, {**X, **friction}, log), columns, forces,
        np.array([[1.0], [-1.0]]), np.zeros((3, 1)), np.array([[0.1, 0.1, 0.0]]), log.dt, parts, gram, log_det,
        innovation, *track,
    )  # fmt: skip
    return gram[0, -1, -1] + log_det[0], np.linalg.eigvalsh(track[1][:done]).min(), innovation


def test_two_surfaces_stick_in_one_filter():
    (one, *_), (five, least, innovation) = two_surfaces(1), two_surfaces(5)
    assert np.isfinite(innovation).all()
    assert least > -1e-12
    assert 0.01 < abs(five - one) < 10  # nothing pushes this robot at random: there is little to tell apart
