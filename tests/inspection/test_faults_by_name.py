"""Each fault put into a clean simulated log is said as docs/faults.md says; nothing is said of a clean log."""

from __future__ import annotations

import re
from functools import lru_cache

import numpy as np
import pytest

from tests import faulty_logs as faulty
from tests.support import ROOT, run
from wheelpend import Failure, Model, identify
from wheelpend.inspection.inspect import inspect_log
from wheelpend.logs.columns import ColumnMap
from wheelpend.logs.log import Log
from wheelpend.logs.read import load_log, save_log

COMMAND = "aggressive"
SCALES = {"revolutions": 1 / (2 * np.pi), "degrees": 180 / np.pi, "motor turns": 30 / (2 * np.pi)}


def turned(name: str, factor: float) -> Log:
    log = faulty.clean()
    return faulty.with_columns(log, **{name: factor * faulty.column(log, name)})


def interchanged() -> Log:
    log = faulty.clean()
    return faulty.with_columns(log, theta_w=faulty.column(log, "theta_p"), theta_p=faulty.column(log, "theta_w"))


def against_the_body() -> Log:
    log = faulty.clean()
    exact = faulty.simulated(COMMAND, 0, noise=False)
    return faulty.with_columns(log, theta_w=faulty.column(log, "theta_w") - faulty.column(exact, "theta_p"))


FAULTS = {
    **{f"wheel angle in {unit}": lambda f=f: turned("theta_w", f) for unit, f in SCALES.items()},
    "wheel angle in counts": lambda: faulty.in_counts(faulty.clean()),
    "wheel angle in counts of an unknown turn": lambda: faulty.with_columns(
        faulty.clean(), theta_w=np.round(np.cumsum(np.random.default_rng(4).normal(size=len(faulty.clean()), scale=40)))
    ),
    "encoder against the body": against_the_body,
    "input in PWM counts": lambda: faulty.as_pwm(faulty.clean(), 255),
    "input as duty": lambda: faulty.as_pwm(faulty.clean(), 1, supply=12, whole=False),
    "a command without its direction": lambda: faulty.with_columns(
        faulty.clean(), v_in=np.abs(faulty.column(faulty.clean(), "v_in"))
    ),
    "input in percent": lambda: faulty.as_pwm(faulty.clean(), 100, supply=12, whole=False),
    "a sign": lambda: turned("theta_w", -1),
    "columns interchanged": interchanged,
    "a channel that was not measured": lambda: faulty.with_columns(
        faulty.clean(), theta_w=faulty.column(faulty.clean(), "v_in")
    ),
    "rows dropped": lambda: faulty.dropped(faulty.clean()),
    "times rounded to a coarse clock": lambda: faulty.rounded_times(faulty.clean()),
    "rows dropped, times made uniform": lambda: faulty.dropped(faulty.clean(), retimed=True),
    "stamps jitter, sampling does not": lambda: faulty.jittering_stamps(faulty.clean()),
    "sampling jitters, stamps do not": lambda: faulty.jittering_samples(faulty.clean()),
    "gyro saturated": lambda: faulty.saturated(faulty.clean(), "dtheta_p"),
    "pitch saturated": lambda: faulty.saturated(faulty.clean(), "theta_p"),
    "spikes": lambda: faulty.spiky(faulty.clean(), "theta_p"),
    "lost counts": lambda: faulty.slipped(faulty.clean(), "theta_w"),
    "a pitch that was filtered": lambda: faulty.smoothed(faulty.clean(), "theta_p"),
    "a pitch fused with an accelerometer": lambda: faulty.simulated(
        COMMAND, 0, accelerometer_tilt__gain=0.02, accelerometer_tilt__time_constant=1.0
    ),
    "a gap": lambda: faulty.rows(faulty.clean(), np.abs(faulty.clean().t - 5.75) > 0.75),
    "two recordings in one file": lambda: faulty.joined(faulty.clean().part(0, 9000), faulty.clean(1)),
    "robot on the floor for a while": lambda: faulty.on_the_floor(faulty.clean(), 5, 12),
    "robot on the floor throughout": lambda: faulty.on_the_floor(faulty.clean(), -1, 30),
    "nothing moves": lambda: faulty.at_rest(faulty.clean()),
    "a gyro that is not connected": lambda: turned("dtheta_p", 0.0),
}


@lru_cache
def documented() -> dict[str, tuple[str, str]]:
    text = (ROOT / "docs" / "faults.md").read_text().partition("## Without a model")[0]
    rows = re.findall(r"^\| (.+?) \| (.+?) \| (.+?) \|$", text, re.M)[1:]
    return {fault: (said, done) for fault, said, done in rows if set(fault) != {"-"}}


def sentences(log: Log) -> list[str]:
    try:
        return [f.sentence for f in inspect_log(log).findings]
    except Failure as failure:
        return [str(failure)]


def test_the_table_lists_every_fault_that_is_tried():
    assert list(documented()) == list(FAULTS)


@pytest.mark.parametrize("fault", FAULTS)
def test_each_fault_is_said_as_the_docs_say(fault):
    said = documented()[fault][0]
    pattern = ".*".join(map(re.escape, said.split("…")))
    found = sentences(FAULTS[fault]())
    assert any(re.fullmatch(pattern, s, re.S) for s in found), (said, found)
    assert fault == "encoder against the body" or not any("measured against the body" in s for s in found)


@pytest.mark.parametrize(("seed", "command"), [(0, "aggressive"), (1, "simple"), (2, "upright")])
def test_nothing_is_said_of_a_clean_log(seed, command):
    assert sentences(faulty.clean(seed, command)) == []


@pytest.mark.parametrize("command", ["aggressive", "simple"])
@pytest.mark.parametrize(("factor", "told"), [(30.0, 30.0), (30 / (2 * np.pi), 4.77), (0.2413, 0.2413)])
def test_the_ratio_of_an_encoder_in_another_unit_is_found_to_three_percent(factor, told, command):
    log = faulty.clean(0, command)
    report = inspect_log(faulty.with_columns(log, theta_w=factor * faulty.column(log, "theta_w")))
    (finding,) = report.findings
    assert finding.size == pytest.approx(told, rel=0.03)
    assert float(re.search(r"scale = ([\d.]+)", report.proposal)[1]) == pytest.approx(1 / told, rel=0.03)


def test_the_advice_on_a_sign_is_what_the_proposal_does():
    log = turned("theta_w", -1)
    report = inspect_log(log, columns={"theta_w": ColumnMap("wheel", sign=-1)})
    (finding,) = report.findings
    assert "without its sign" in finding.cure and "sign" not in report.proposal
    report = inspect_log(log)
    assert "with sign = -1" in report.findings[0].cure and "sign = -1" in report.proposal


@pytest.mark.parametrize("samples", [2000, 20001])
def test_no_sign_is_proposed_that_no_finding_names(samples):
    log = turned("dtheta_p", -1).part(0, samples)
    report = inspect_log(log)
    assert [f.channel for f in report.findings if f.kind == "flipped_sign"] == re.findall(
        r"^(\w+) = .*sign", report.proposal, re.M
    )


def test_nothing_odd_is_never_said_under_a_finding(tmp_path):
    save_log(tmp_path / "dropped.csv", FAULTS["rows dropped"]())
    save_log(tmp_path / "clean.csv", faulty.clean())
    assert "Nothing odd" not in run("inspect", tmp_path / "dropped.csv").stdout
    assert "Nothing odd was found." in run("inspect", tmp_path / "clean.csv").stdout


@pytest.mark.parametrize(("share", "retimed"), [(0.05, False), (0.05, True), (0.01, True)])
def test_the_share_of_dropped_rows_is_told(share, retimed):
    found = {f.kind: f.size for f in inspect_log(faulty.dropped(faulty.clean(), share, retimed)).findings}
    assert found["retimed_rows" if retimed else "dropped_rows"] == pytest.approx(share, rel=0.25)


def test_the_size_of_jitter_is_told():
    expected = 0.1e-3 / np.sqrt(3)
    (stamps,) = inspect_log(faulty.jittering_stamps(faulty.clean())).findings
    (samples,) = inspect_log(faulty.jittering_samples(faulty.clean())).findings
    assert stamps.size == pytest.approx(np.sqrt(2) * expected, rel=0.1)
    assert samples.size == pytest.approx(expected, rel=0.15)


def test_a_loop_that_slows_down_while_the_machine_is_fast_is_no_jitter():
    t, turned = np.zeros(900), np.zeros(900)
    for k in range(1, len(t)):
        speed = 6.0 * np.sin(0.9 * t[k - 1])
        interval = 0.015 + 0.0008 * abs(speed)  # the program prints more digits
        t[k], turned[k] = t[k - 1] + interval, turned[k - 1] + interval * speed
    log = Log("slower", t, np.sin(t), np.round(turned, 3)[:, None], ("theta_1",), rates={})
    assert not [f for f in inspect_log(log, table=Model.default("pendulum").table).findings if "jitter" in f.kind]


def test_an_input_that_a_proportional_controller_made_is_no_copy():
    log = faulty.clean()
    pushed = faulty.with_columns(log, v_in=8.0 * (0.1 - faulty.column(log, "theta_w")))
    assert "copy" not in {f.kind for f in inspect_log(pushed).findings}
    twice = faulty.with_columns(log, dtheta_p=2.0 * faulty.column(log, "theta_p"))
    assert "copy" in {f.kind for f in inspect_log(twice).findings}


@pytest.mark.parametrize("name", ["dtheta_p", "theta_p"])
def test_readings_at_the_ceiling_of_a_sensor_are_left_out_of_a_fit(name, tmp_path):
    log = faulty.saturated(faulty.clean(), name)
    save_log(tmp_path / "saturated.csv", log)
    read = load_log(tmp_path / "saturated.csv")
    values, ceiling = faulty.column(read, name), np.abs(faulty.column(log, name)).max()
    assert np.nanmax(np.abs(values)) < ceiling and 0.05 < np.isnan(values).mean() < 0.1
    assert sum("saturated" in w for w in read.warnings) == 1


def test_no_segment_spans_two_recordings_nor_a_robot_on_the_floor(tmp_path):
    from wheelpend.logs.log import segment_bounds

    save_log(tmp_path / "joined.csv", FAULTS["two recordings in one file"]())
    bounds = segment_bounds(load_log(tmp_path / "joined.csv"), 0.5)
    assert not any(first <= 8999 < last - 1 for first, last in bounds)
    save_log(tmp_path / "floor.csv", FAULTS["robot on the floor for a while"]())
    log = load_log(tmp_path / "floor.csv")
    bounds = segment_bounds(log, 0.5)
    assert not any(log.t[first] < 11.8 and log.t[last - 1] > 5.4 for first, last in bounds)
    assert bounds[-1][1] > 19_000


@pytest.mark.parametrize("fault", ["nothing moves", "robot on the floor throughout"])
def test_a_log_that_says_nothing_is_refused_by_a_fit(fault, tmp_path):
    save_log(tmp_path / "log.csv", FAULTS[fault]())
    with pytest.raises(Failure, match="Record a log in which"):
        identify(Model.default(), [tmp_path / "log.csv"])


def test_a_wheel_that_stops_at_its_furthest_is_no_saturated_sensor():
    from wheelpend.logs.faults import readings_at_ceiling

    t = np.linspace(0, 6, 3000)
    stopped = np.round(np.where(t < 3, 1 - np.cos(t * np.pi / 3), 2.0) / 1e-3) * 1e-3
    assert not readings_at_ceiling(stopped)[0].any()
    clipped = np.clip(np.round(np.sin(3 * t) / 1e-3) * 1e-3, -0.5, 0.5)
    assert 0.5 < readings_at_ceiling(clipped)[0].mean() < 0.8


def test_a_slip_of_the_encoder_alone_is_not_called_two_recordings():
    log = faulty.clean()
    wheel = faulty.column(log, "theta_w") + 0.7 * (log.t > 10)
    assert "joined" not in [f.kind for f in inspect_log(faulty.with_columns(log, theta_w=wheel)).findings]
