"""Inputs without values: switched off for a while, or logged only on a change."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support import CHANNELS
from wheelpend import Model, identify
from wheelpend.errors import Failure
from wheelpend.logs.commands import held_commands, longest_known_part
from wheelpend.logs.log import Log
from wheelpend.logs.read import load_log, save_log

NAN = np.nan


def made(voltage):
    """A log with these commands every hundredth of a second."""
    t = np.arange(len(voltage)) * 0.01
    measured = np.column_stack([np.sin(t), 0.1 * np.cos(t), 0.1 * np.sin(3 * t)])
    return Log("made.csv", t, np.asarray(voltage, dtype=float), measured, CHANNELS)


def read_back(folder, voltage):
    """The same log through a file."""
    save_log(folder / "log.csv", made(voltage))
    return load_log(folder / "log.csv")


def switched_off(n=600, first=200, last=250):
    """Commands that are unknown in a range of samples."""
    voltage = np.sin(0.1 * np.arange(n))
    voltage[first:last] = NAN
    return voltage


def test_a_stretch_without_commands_is_said_from_when_to_when(tmp_path):
    log = read_back(tmp_path, switched_off())
    assert np.flatnonzero(np.isnan(log.voltage)).tolist() == list(range(200, 250))
    (warning,) = log.warnings
    assert "v_in has no value from t = 2 s to 2.49 s (50 samples)" in warning
    assert "the log before and after it is used" in warning


def test_several_stretches_are_counted_and_the_longest_is_named(tmp_path):
    voltage = switched_off()
    voltage[[400, 450]] = NAN
    (warning,) = read_back(tmp_path, voltage).warnings
    assert "in 3 stretches (52 samples), the longest from t = 2 s to 2.49 s" in warning


def test_commands_logged_on_a_change_are_held_until_the_next(tmp_path):
    voltage = np.repeat([1.0, -2.0, 3.0, 0.5], [30, 47, 11, 32])
    sparse = np.where(np.diff(voltage, prepend=NAN) == 0.0, NAN, voltage)
    log = read_back(tmp_path, sparse)
    np.testing.assert_array_equal(log.voltage, voltage)
    assert "none like the one before, so it is logged on a change; each is held until the next" in log.warnings[0]


def test_commands_of_a_slower_clock_are_held_until_the_next():
    values = np.full(100, NAN)
    values[2::5] = np.round(np.arange(20) / 3)  # some equal to the one before
    held, (remark,) = held_commands("log", "v_in", values)
    np.testing.assert_array_equal(held[2:], np.repeat(values[2::5], 5)[:98])
    assert np.isnan(held[:2]).all()  # before the first command nothing is known
    assert "a value once in 5 samples" in remark


def test_sparse_commands_of_which_some_repeat_are_refused_with_the_cure():
    values = np.full(100, NAN)
    values[[0, 7, 30, 41, 90]] = [1.0, 2.0, 2.0, 1.0, 3.0]
    with pytest.raises(Failure, match=r"has 5 values in 100 samples, some of them equal.*forward"):
        held_commands("log", "v_in", values)


@pytest.mark.parametrize("share", [0.01, 0.3, 0.6])
def test_commands_lost_at_random_are_not_held(share):
    rng = np.random.default_rng(3)
    values = np.where(rng.random(2000) < share, NAN, rng.normal(size=2000))
    held, remarks = held_commands("log", "v_in", values)
    np.testing.assert_array_equal(held, values)
    assert not remarks


def test_the_longest_part_with_commands_is_taken_and_single_lost_ones_do_not_cut():
    voltage = switched_off()
    voltage[[300, 420]] = NAN
    part, remark = longest_known_part(made(voltage))
    assert (part.t[0], part.t[-1], len(part)) == (2.5, pytest.approx(5.99), 350)
    assert "Only the part from t = 2.5 s to 5.99 s is used" in remark
    whole = made(np.sin(np.arange(600)))
    assert longest_known_part(whole) == (whole, "")


def test_a_log_with_commands_only_now_and_then_is_refused():
    voltage = np.where(np.arange(600) % 30 < 15, 1.0, NAN)
    with pytest.raises(Failure, match=r"commands for at least 20 samples in a row.* has 15"):
        longest_known_part(made(voltage))


@pytest.mark.parametrize("method", ["shooting", "filtered", "differentiation"])
def test_what_happened_while_the_motors_were_off_leaves_estimates_alone(method):
    from tests.support import simulated

    log = simulated(duration=8.0)
    voltage, measured = log.voltage.copy(), log.measured.copy()
    off = (log.t > 1.0) & (log.t < 2.5)
    voltage[off] = NAN
    measured[off] += np.sin(40 * log.t[off])[:, None]  # something that no model explains
    found = identify(
        Model.default(), [replace(log, voltage=voltage, measured=measured)], method=method, test_bias=False
    )
    after = identify(
        Model.default(), [log.part(int(np.argmax(log.t >= 2.5)), len(log))], method=method, test_bias=False
    )
    for name in ("X5", "X6", "X7"):
        one, other = found.parameters[name], after.parameters[name]
        assert abs(one.value - other.value) < 4 * np.hypot(one.sigma, other.sigma), name
        assert one.sigma < 1.5 * other.sigma


def test_the_log_before_an_unknown_stretch_is_used_too():
    from tests.support import simulated

    log = simulated(duration=8.0)
    voltage = log.voltage.copy()
    voltage[(log.t > 5.0) & (log.t < 5.5)] = NAN
    both = identify(Model.default(), [replace(log, voltage=voltage)])
    after = identify(Model.default(), [log.part(int(np.argmax(log.t >= 5.5)), len(log))])
    assert both.parameters["X5"].sigma < 0.7 * after.parameters["X5"].sigma
    assert both.error < 1.05 * both.noise_floor


def test_a_part_in_one_piece_goes_over_no_gap_but_where_little_would_be_left():
    log = made(np.sin(0.1 * np.arange(600)))
    later = replace(log, t=log.t + 0.7 * (np.arange(600) >= 250))
    part, remark = longest_known_part(later)
    assert (len(part), part.t[0]) == (350, later.t[250]) and "elsewhere there is a gap." in remark
    often = replace(log, t=log.t + 0.7 * (np.arange(600) // 20))
    assert longest_known_part(often) == (often, "")


def test_a_regression_does_not_integrate_over_a_gap():
    t = 0.01 * np.arange(4000)
    volts, speed, place = np.sign(np.sin(0.7 * t)) + np.sin(1.9 * t), 0.0, [0.0]
    for u in volts[:-1]:  # 0.5 s² V/m of inertia, 1 V s/m of friction, each command held
        change = (speed - u) * (1.0 - np.exp(-0.02))
        place.append(place[-1] + 0.01 * u + (speed - u) * 0.5 * (1.0 - np.exp(-0.02)))
        speed -= change
    kept = (t < 15.0) | (t > 17.0)
    columns = {"t": t[kept], "v_in": volts[kept], "x": np.array(place)[kept]}
    model = Model.parse('plant = "slide"\neffects = ["viscous_drive"]\n')
    found = identify(model, [columns], method="filtered").parameters
    assert found["X1"].value == pytest.approx(0.5, rel=0.01)
    assert found["viscous_drive.coefficient"].value == pytest.approx(1.0, rel=0.01)


def test_a_part_in_one_piece_holds_no_jump_of_a_sensor():
    log = replace(made(switched_off()), breaks=(230, 450))
    part, remark = longest_known_part(log)
    assert (len(part), part.t[0], part.breaks) == (200, 0.0, ())
    assert "elsewhere the input is unknown for a while and a sensor jumps" in remark
    part, remark = longest_known_part(replace(made(np.sin(np.arange(600))), breaks=(100,)))
    assert (len(part), part.t[0], part.breaks) == (500, 1.0, ())
    assert "elsewhere a sensor jumps." in remark


def test_differentiation_runs_across_no_jump_of_the_encoder():
    from tests.support import simulated

    log = simulated(duration=8.0)
    measured = log.measured.copy()
    measured[2000:, 0] += 0.5
    jumped = identify(Model.default(), [replace(log, measured=measured)], method="differentiation", test_bias=False)
    after = identify(Model.default(), [log.part(2000, len(log))], method="differentiation", test_bias=False)
    for name in ("X1", "X5"):
        assert jumped.parameters[name].value == pytest.approx(after.parameters[name].value, rel=0.02), name


def test_a_part_in_one_piece_is_of_one_recording_and_each_warms_up_by_itself():
    from tests import faulty_logs as faulty
    from wheelpend.logs.recording import cured

    log = cured(faulty.joined(faulty.clean().part(0, 9000), faulty.clean(1)), Model.default().table)
    assert log.breaks == (9000,)
    part, _ = longest_known_part(log)
    assert part.t[0] == pytest.approx(log.t[9000]) and len(part) == len(log) - 9000
    second = next(s for s in log.stretches if s.begin == 9000)
    assert second.settled > second.begin
