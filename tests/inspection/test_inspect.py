"""Faults planted in a simulated log are found, and nothing is found where there is none."""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from tests.support import CHANNELS, DATA
from wheelpend import Model
from wheelpend.inspection.inspect import inspect_for_model, inspect_log
from wheelpend.inspection.signals import MAX_SHIFT_SAMPLES, parabolic_minimum
from wheelpend.kernels import load as kernels
from wheelpend.logs.columns import ColumnMap
from wheelpend.logs.log import Log
from wheelpend.logs.read import load_log
from wheelpend.reports.text.inspection import inspection_text, untested_sentence
from wheelpend.serialise import dumps, to_json
from wheelpend.simulation.closed_loop import ClosedLoop

ROBOT = {"X1": 0.0436, "X2": 0.0178, "X3": 0.1149, "X4": 0.8719, "X5": 4.6701, "X6": 0.7268, "X7": 0.7256}
GEOMETRY = {"R": 0.2413, "g": 9.81, "alpha": 165.42, "J_w": 0.1339}
DEGREE = np.pi / 180
STEP = 2 * np.pi / 60000  # of the encoder [rad]
REAL = DATA / "mini_segway" / "balancing.csv"


@lru_cache
def robot(command: str = "aggressive", seed: int = 1, effect: str = "", size: float = 0.0) -> tuple[Log, np.ndarray]:
    """Noisy closed-loop log of 20 s and its true states (N, 4)."""
    module = kernels.library_module("wheel_pendulum", {})
    t = np.arange(20_001) * 1e-3
    simple = 20 * np.sin(t)
    aggressive = 3 * np.sin(7 * t) + 6 * (np.cos(4 * t) - np.sin(t)) + 10 * np.cos(3 * t) * np.sin(5 * t) ** 2
    reference = DEGREE * (simple if command == "simple" else aggressive)
    assert not effect or effect in module.PARAMETERS
    values = ROBOT | GEOMETRY | {effect: size}
    parameters = np.array([values.get(*pair) for pair in zip(module.PARAMETERS, module.ABSENT, strict=True)])
    noise = np.random.default_rng(seed).normal(size=(t.size, 3)) * [0, 0.5 * DEGREE, 0.5 * DEGREE]
    loop = ClosedLoop(module, np.array([-168.0, -800.0, -8.8]))
    run = loop.play(t, reference, np.gradient(reference, t), np.zeros(4), parameters, noise, np.array([STEP, 0.0, 0.0]))
    return Log("simulated", t, run.input, run.measured, CHANNELS, reference), run.states


def scaled(log: Log, v_in: float = 1.0, theta_w: float = 1.0, theta_p: float = 1.0, dtheta_p: float = 1.0) -> Log:
    return replace(log, voltage=v_in * log.voltage, measured=log.measured * [theta_w, theta_p, dtheta_p])


def late(log: Log, samples: int, *names: str) -> Log:
    measured = log.measured.copy()
    for name in set(names) & set(CHANNELS):
        measured[:, CHANNELS.index(name)] = np.roll(measured[:, CHANNELS.index(name)], samples)
    voltage = np.roll(log.voltage, samples) if "v_in" in names else log.voltage
    return replace(log, voltage=voltage, measured=measured).part(50, len(log) - 50)


def relative() -> Log:
    log, states = robot()
    wheel = np.round((states[:, 0] - states[:, 1]) / STEP) * STEP
    return replace(log, measured=np.column_stack((wheel, log.measured[:, 1:])))


def kinds(log: Log, relative: bool = False) -> list[tuple[str, str]]:
    return [(f.kind, f.channel) for f in inspect_log(log, relative=relative).findings]


@pytest.mark.parametrize("command", ["aggressive", "simple"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_nothing_is_found_in_a_clean_log(command, seed):
    assert kinds(robot(command, seed)[0]) == []


@pytest.mark.parametrize("command", ["aggressive", "simple"])
@pytest.mark.parametrize(
    ("effect", "size"),
    [
        ("coulomb_drive.torque", 0.3),
        ("slope.angle", 0.05),
        ("actuator_delay.delay", 0.004),
        ("voltage_dead_zone.threshold", 0.5),
        ("gyro_bias.bias", 0.05),
        ("gyro_scale.scale", 0.05),
        ("rolling_resistance.torque", 0.3),
    ],
)
def test_missing_physics_is_not_mistaken_for_a_fault_of_the_log(effect, size, command):
    assert kinds(robot(command, 1, effect, size)[0]) == []


@pytest.mark.parametrize("command", ["aggressive", "simple"])
@pytest.mark.parametrize(
    "names", [("v_in",), ("theta_w",), ("theta_p",), ("dtheta_p",), ("dtheta_p", "theta_p"), ("dtheta_p", "theta_w")]
)
def test_the_channels_that_count_the_other_way_are_named(names, command):
    log = scaled(robot(command)[0], **dict.fromkeys(names, -1.0))
    assert kinds(log) == [("flipped_sign", name) for name in names]


def test_a_relative_encoder_is_told_from_an_absolute_one():
    assert kinds(relative(), relative=True) == []
    assert kinds(relative(), relative=False) == [("relative_encoder", "theta_w")]
    assert kinds(robot()[0], relative=True) == [("absolute_encoder", "theta_w")]


@pytest.mark.parametrize("names", [("theta_w",), ("theta_p",), ("dtheta_p",), ("theta_p", "dtheta_p")])
def test_degrees_are_recognised(names):
    log = scaled(robot()[0], **dict.fromkeys(names, 1 / DEGREE))
    assert kinds(log) == [("wrong_unit", name) for name in names]


def test_a_gyro_of_another_scale_is_reported_with_the_factor():
    (finding,) = inspect_log(scaled(robot()[0], dtheta_p=1.3)).findings
    assert finding.kind == "wrong_unit"
    assert finding.size == pytest.approx(1.3, abs=0.01)


@pytest.mark.parametrize("order", [(0, 2, 1), (1, 0, 2), (2, 1, 0)])
@pytest.mark.parametrize("command", ["aggressive", "simple"])
def test_interchanged_columns_are_found(order, command):
    log = robot(command)[0]
    names = sorted(c for k, c in enumerate(CHANNELS) if order[k] != k)
    assert kinds(replace(log, measured=log.measured[:, order])) == [("swapped_channels", " and ".join(names))]


def test_a_rate_that_was_computed_from_its_angle_is_in_its_own_column():
    log = scaled(robot()[0])
    angle = log.measured[:, CHANNELS.index("theta_p")]
    log.measured[:, CHANNELS.index("dtheta_p")] = np.gradient(angle, log.t)
    assert "swapped_channels" not in [kind for kind, _ in kinds(log)]


@pytest.mark.parametrize("command", ["aggressive", "simple"])
@pytest.mark.parametrize("samples", [-20, 10])
@pytest.mark.parametrize("names", [("theta_w",), ("theta_p",), ("dtheta_p",), ("theta_p", "dtheta_p")])
def test_a_sensor_with_its_own_clock_is_found_with_its_shift(names, samples, command):
    (finding,) = inspect_log(late(robot(command)[0], samples, *names)).findings
    assert (finding.kind, finding.channel) == ("time_shift", " and ".join(names))
    assert finding.size == pytest.approx(samples * 1e-3, abs=1e-3)


@pytest.mark.parametrize("command", ["aggressive", "simple"])
def test_an_input_that_acts_late_may_be_physics_and_one_that_acts_early_cannot(command):
    (delayed,) = inspect_log(late(robot(command)[0], -15, "v_in")).findings
    (early,) = inspect_log(late(robot(command)[0], 15, "v_in")).findings
    assert delayed.size == pytest.approx(0.015, abs=1e-3)
    assert "actuator_delay" in delayed.sentence
    assert early.size == pytest.approx(-0.015, abs=1e-3)
    assert "no machine does that" in early.sentence


def test_a_wrapped_wheel_angle_is_the_only_thing_reported():
    log = robot()[0]
    wrapped = np.mod(log.measured[:, 0], 2 * np.pi)
    assert kinds(replace(log, measured=np.column_stack((wrapped, log.measured[:, 1:])))) == [
        ("wrapped_angle", "theta_w")
    ]


def test_gaps_and_a_wheel_that_stands_still_are_reported():
    log = robot()[0]
    t, measured = log.t.copy(), log.measured.copy()
    t[10_000:] += 0.5
    measured[15_000:17_000, 0] = measured[15_000, 0]
    found = {f.kind: f.size for f in inspect_log(replace(log, t=t, measured=measured)).findings}
    assert found["gap"] == pytest.approx(0.501)
    assert found["stand_still"] == pytest.approx(2.0, abs=0.5)


@pytest.mark.parametrize(
    ("rows", "said"), [(2000, "Nothing to do"), (80, "No stretch without a gap has the 100 samples")]
)
def test_gaps_that_leave_no_stretch_to_fit_are_told(rows, said):
    log = robot()[0]
    bursts = replace(log, t=log.t + 0.5 * (np.arange(len(log.t)) // rows))
    (cure,) = (f.cure for f in inspect_log(bursts).findings if f.kind == "gap")
    assert cure.startswith(said)


def test_a_dead_gyro_is_reported_and_nothing_is_concluded_from_it():
    assert kinds(scaled(robot()[0], dtheta_p=0.0)) == [("silent_sensor", "dtheta_p")]


def test_missing_cells_and_jitter_do_not_disturb():
    log = robot()[0]
    rng = np.random.default_rng(5)
    measured = log.measured.copy()
    measured[rng.random(measured.shape) < 0.02] = np.nan
    report = inspect_log(replace(log, measured=measured, t=log.t + 2e-5 * rng.random(len(log))))
    assert report.findings == ()
    assert report.channels["theta_p"]["missing"] == pytest.approx(0.02, abs=0.005)
    assert 0 < report.jitter < 0.02


def test_the_proposal_is_built_on_the_columns_with_which_the_log_was_read():
    log = scaled(relative(), v_in=-1.0, dtheta_p=1 / DEGREE)
    known = {"v_in": ColumnMap("volts", sign=-1), "dtheta_p": ColumnMap("gyro_y", unit="rad/s")}
    proposal = tomllib.loads(inspect_log(log, columns=known).proposal)
    assert proposal == {
        "columns": {"v_in": {"column": "volts"}, "dtheta_p": {"column": "gyro_y", "unit": "deg/s"}},
        "sensors": {"encoder": "relative"},
    }


def test_the_report_is_strict_json():
    report = to_json(inspect_log(late(robot()[0], 10, "theta_w")))
    assert json.loads(dumps(report))["schema"] == 1
    assert report["rate_hz"] == pytest.approx(1000)
    assert report["channels"]["theta_w"]["quantum"] == pytest.approx(STEP, rel=1e-3)


def test_a_short_log_is_described_and_not_judged():
    report = inspect_log(scaled(robot()[0], v_in=-1.0).part(0, 100))
    assert (report.samples, report.findings, report.proposal) == (100, (), "")


@pytest.mark.skipif(not REAL.exists(), reason="the measured log is not here")
def test_a_measured_log_is_recognised_as_relative_and_has_no_other_fault():
    log = load_log(REAL)
    filtered = [("filtered", "theta_p"), ("filtered", "dtheta_p")]  # a Mahony filter, and the low-pass of the gyro
    assert kinds(log, relative=True) == filtered
    assert kinds(log, relative=False) == [*filtered, ("relative_encoder", "theta_w")]


@pytest.mark.parametrize("names", [("theta_w",), ("dtheta_p",), ("theta_p", "dtheta_p")])
def test_a_time_shift_is_found_to_a_fifth_of_a_sample(names):
    (finding,) = inspect_log(late(robot()[0], 10, *names)).findings
    assert finding.size == pytest.approx(0.010, abs=0.2e-3)


def test_an_input_that_acts_late_is_timed_to_a_fifth_of_a_sample():
    (finding,) = inspect_log(late(robot()[0], -15, "v_in")).findings
    assert finding.size == pytest.approx(0.015, abs=0.2e-3)


def test_a_parabola_through_three_shifts_has_its_lowest_point_between_them():
    shifts = np.arange(-MAX_SHIFT_SAMPLES, MAX_SHIFT_SAMPLES + 1)
    for at in (-3.3, 0.0, 4.25):
        assert parabolic_minimum((shifts - at) ** 2 + 5.0) == pytest.approx(at)
    assert parabolic_minimum(shifts.astype(float)) == -MAX_SHIFT_SAMPLES


def test_statistics_are_in_the_units_of_each_channel():
    log = robot()[0]
    found = inspect_log(log)
    assert found.jitter == pytest.approx(0.0, abs=1e-6) and found.duration_s == pytest.approx(20.0)
    assert found.channels["theta_p"]["noise"] == pytest.approx(0.5 * DEGREE, rel=0.1)
    t = log.t + 3.0 * (np.arange(len(log)) > 9000)
    assert inspect_log(replace(log, t=t)).jitter == pytest.approx(0.0, abs=1e-6)  # a gap is none
    shaken = inspect_log(replace(log, t=log.t + 1e-4 * np.random.default_rng(0).uniform(-1, 1, size=len(log))))
    assert shaken.jitter == pytest.approx(0.1 * np.sqrt(2 / 3), rel=0.05)
    assert found.channels["v_in"]["maximum"] == np.max(log.voltage)
    assert found.channels["dtheta_p"]["minimum"] == np.min(log.measured[:, 2])


def axis_driven(samples: int, sign: float) -> dict[str, np.ndarray]:
    """Columns of an axis with viscous friction under steps of voltage, from an integrator of its own."""
    dt, commands = 0.01, np.repeat(np.random.default_rng(3).uniform(-6.0, 6.0, samples), 20)[:samples]
    t, speed, place = np.arange(samples) * dt, np.zeros(samples), np.zeros(samples)
    for k in range(samples - 1):
        decay = np.exp(-dt / 0.15)  # of the speed towards half of the command
        speed[k + 1] = 0.5 * commands[k] + (speed[k] - 0.5 * commands[k]) * decay
        place[k + 1] = place[k] + 0.5 * commands[k] * dt + 0.15 * (speed[k] - 0.5 * commands[k]) * (1.0 - decay)
    noise = 2e-4 * np.random.default_rng(4).normal(size=samples)
    return {"t": t, "v_in": sign * commands, "x": place + noise}


@pytest.mark.parametrize("samples", [150, 260, 340])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_sign_is_found_in_a_log_of_a_few_seconds_and_none_where_it_is_right(samples, sign):
    model = Model.parse('plant = "slide"\n')
    found = inspect_for_model(model, load_log(axis_driven(samples, sign), table=model.table))
    assert [f.kind for f in found.findings] == ([] if sign > 0.0 else ["flipped_sign"])
    assert found.untested == ({"clocks": 250} if samples < 250 else {})


def test_it_is_said_of_a_shorter_log_that_signs_were_not_tested():
    model = Model.parse('plant = "slide"\n')
    moving = {name: values[110:] for name, values in axis_driven(200, -1.0).items()}
    log = load_log(moving, table=model.table, name="short")
    found = inspect_for_model(model, log)
    said = [text for text in inspection_text(log, found) if isinstance(text, str)]
    assert untested_sentence(found).startswith("Signs and clocks were not tested: that takes 100 and 250 samples")
    assert not found.findings and untested_sentence(found) in said and "Nothing odd was found." not in said


@pytest.mark.parametrize("commanded", [0.0, 4.0])
def test_one_that_rests_while_nothing_is_commanded_has_no_sensor_to_check(commanded):
    columns = axis_driven(400, 1.0)
    rest = (columns["t"] >= 1.5) & (columns["t"] < 3.0)
    columns["v_in"][rest] = commanded
    columns["x"][rest] = columns["x"][150]
    columns["x"] = np.round(columns["x"], 3)
    model = Model.parse('plant = "slide"\n')
    found = inspect_for_model(model, load_log(columns, table=model.table)).findings
    (still,) = [f for f in found if f.kind == "stand_still"]
    assert ("Nothing is commanded then" in still.cure) == (commanded == 0.0)
    assert ("check this sensor" in still.cure) == (commanded != 0.0)
