"""In the loop: friction that is compensated in another engine, and parameters that are learnt as the machine runs."""

import shutil
import subprocess

import numpy as np
import pytest

from tests.export.exporting import model_with
from wheelpend.export.c_target import c_files
from wheelpend.export.compensation import compensation_of
from wheelpend.export.exported_model import exported_model
from wheelpend.simulation.references import reference

pytestmark = pytest.mark.slow


class Observed:
    """The exported observer and compensator, by their kernels."""

    def __init__(self, exported):
        self.e, self.m, self.c = exported, exported.module, compensation_of(exported)
        e, count = exported, len(exported.sources)
        self.parameters, self.none = e.parameters.copy(), np.zeros(0, np.int64)
        self.now, self.commands, self.found = np.zeros(e.size), np.zeros(e.commands), np.zeros(3)
        self.moving = [np.zeros((e.size, e.size + 2)), np.zeros(count), np.zeros((count, 0)),
                       np.zeros((e.size + count, e.size + count))]  # fmt: skip
        self.rubbing = np.zeros(self.m.SURFACES)
        self.m.start_filter(np.zeros(4), e.spread, 0.0, self.parameters, e.reads, e.noise, self.now, self.commands,
                            *self.moving, self.rubbing)  # fmt: skip

    def command(self, t, measured, wanted):
        e, c = self.e, self.c
        self.m.filter_readings(t, measured, 1.0 / e.readings_sigma, self.parameters, self.none, e.reads, self.now,
                               *self.moving, np.zeros((0, 0)), 1.0, np.zeros(0), self.found,
                               np.zeros(3), np.zeros(3))  # fmt: skip
        command = self.m.compensate(0.0, wanted, self.now, c.forces, c.absent, c.maps, c.shares, c.least_slip,
                                    c.least_input)  # fmt: skip
        self.m.filter_step(t, e.period, command, self.parameters, self.none, e.forces, e.mixing, e.reads, e.noise,
                           e.max_step, self.now, self.commands, *self.moving, self.rubbing)  # fmt: skip
        return command


def pitch_in_mujoco(friction, known, sigma, command, duration=5.0):
    """The true pitch of the robot in MuJoCo under its PID controller; compensated where the friction is ``known``."""
    from wheelpend.benchmarks.hidden_effects.engine import PID_GAINS, Robot, commanded_pitch, sample_count
    from wheelpend.benchmarks.hidden_effects.laws import SENSOR_NOISE_SIGMA
    from wheelpend.benchmarks.hidden_effects.scene import TRUE_PARAMETERS

    count, h = sample_count(duration), 0.001
    robot = Robot({"coulomb_drive.torque": friction} if friction else {}, 2e-4, count)
    t = np.arange(count) * h
    angle, rate = commanded_pitch(command, t) if command else (np.zeros(count), np.zeros(count))
    scatter = np.random.default_rng(1).normal(size=(count, 2)) * SENSOR_NOISE_SIGMA
    values = {n: (v, 1e-3 * abs(v)) for n, v in TRUE_PARAMETERS.items()} | {"coulomb_drive.torque": (known, sigma)}
    observed = Observed(exported_model(model_with("coulomb_drive").with_fit(values))) if known else None
    commands, pitch, integral = np.zeros(count), np.zeros(count), 0.0
    for k in range(count):
        measured, pitch[k] = robot.measured(scatter[k]), robot.data.qpos[1]
        error = angle[k] - measured[1]
        integral += error * h if k else 0.0
        commands[k] = PID_GAINS[0] * error + PID_GAINS[1] * integral + PID_GAINS[2] * (rate[k] - measured[2])
        if observed:
            commands[k] = observed.command(t[k], measured, commands[k])
        robot.move(t[k], commands[: k + 1])
    return pitch


@pytest.mark.extras
@pytest.mark.parametrize("friction", [0.1, 0.5])
def test_compensation_halves_what_friction_does_to_the_pitch_and_starts_no_limit_cycle(friction):
    pytest.importorskip("mujoco")
    sigma, random = 0.02 * friction, np.random.default_rng(round(100 * friction))
    known = friction + sigma * random.normal()  # as identified
    for command in ("aggressive", ""):
        smooth, rough = pitch_in_mujoco(0.0, 0.0, 0.0, command), pitch_in_mujoco(friction, 0.0, 0.0, command)
        helped = pitch_in_mujoco(friction, known, sigma, command)
        assert np.std(helped - smooth) < 0.5 * np.std(rough - smooth)
        assert np.std(helped[-2000:]) < 1.1 * np.std(smooth[-2000:])  # sensors' noise alone moves it


def test_the_identifier_ends_within_the_errors_that_it_says():
    """From a fifth off, after 20 s, with the small force that it expects."""
    exported = exported_model(model_with("coulomb_drive").with_fit(
        {n: (v, 0.01 * v) for n, v in (("X1", 0.0437), ("X2", 0.0178), ("X3", 0.115), ("X4", 0.872), ("X5", 4.67),
                                       ("X6", 0.727), ("X7", 0.726), ("coulomb_drive.torque", 0.3))}
    ))  # fmt: skip
    e, m = exported, exported.module
    columns = np.array([m.PARAMETERS.index(n) for n in m.LINEAR if not n.startswith("missing")], dtype=np.int64)
    n, count, h = len(columns), 20_001, 0.001
    t, sigma = np.arange(count) * h, e.readings_sigma
    angle, rate = reference("aggressive", t, e.model.table)
    misses = []
    for seed in range(4):
        random = np.random.default_rng(seed)
        ring = [e.parameters.copy(), np.zeros(e.size), np.zeros(e.commands), np.zeros((e.late_readings, 3))]
        m.start_machine(np.zeros(4), 0.0, *ring)
        p = e.parameters.copy()
        p[columns] *= 1.0 + 0.2 * np.clip(random.normal(size=n), -2.0, 2.0)
        learnt, least = np.diag((0.3 * p[columns]) ** 2), 0.05 * p[columns]
        now, commands, found = np.zeros(e.size), np.zeros(e.commands), np.zeros(3)
        moving = [np.zeros((e.size, e.size + 2 + n)), np.zeros(1), np.zeros((1, n)), np.zeros((e.size + 1, e.size + 1))]
        rubbing, output, integral = np.zeros(m.SURFACES), np.zeros(3), 0.0
        m.start_filter(np.zeros(4), e.spread, 0.0, p, e.reads, e.noise, now, commands, *moving, rubbing)
        gains = e.model.controller.gains
        for k in range(count):
            measured = output + sigma * random.normal(size=3)
            error = angle[k] - measured[1]
            integral += error * h
            voltage = gains[0] * error + gains[1] * integral + gains[2] * (rate[k] - measured[2])
            m.filter_readings(t[k], measured, 1.0 / sigma, p, columns, e.reads, now, *moving, learnt, 1.0, least, found,
                              np.zeros(3), np.zeros(3))  # fmt: skip
            m.filter_step(t[k], h, voltage, p, columns, e.forces, e.mixing, e.reads, e.noise, h, now, commands, *moving,
                          rubbing)  # fmt: skip
            m.step_machine(t[k], h, voltage, ring[0], h, *ring[1:], output)
        misses.append((p[columns] - e.parameters[columns]) / np.sqrt(np.diag(learnt)))
    assert 0.3 < np.sqrt(np.mean(np.square(misses))) < 2.0  # of the standard errors that it says of itself


FIRMWARE = ["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]
SINGLE = ["-O2", "-ffp-contract=off", "-fno-math-errno", "-std=c99", "-DWP_SINGLE", "-DBITS"]


@pytest.mark.skipif(not (shutil.which("arm-none-eabi-gcc") and shutil.which("qemu-system-arm") and shutil.which("gcc")),
                    reason="needs arm-none-eabi-gcc and qemu-system-arm")  # fmt: skip
def test_a_cortex_m4f_gives_the_bits_of_the_host(tmp_path):
    from pathlib import Path

    here = Path(__file__).parent / "firmware"
    for name, text in c_files(exported_model(model_with("coulomb_drive", "actuator_delay"))).items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    source = [str(tmp_path / "src/wheelpend_model.c"), str(here / "main.c"), "-I", str(tmp_path / "src")]
    subprocess.run(["gcc", *SINGLE, *source, "-o", tmp_path / "host"], check=True)
    arm = ["arm-none-eabi-gcc", *FIRMWARE, *SINGLE]

    def part(name):
        return subprocess.run(
            [*arm, f"-print-file-name={name}"], capture_output=True, text=True, check=True
        ).stdout.strip()

    start = [part(name) for name in ("crti.o", "crtn.o")]
    newlib = str(Path(part("libc.a")).parent / "rdimon-crt0.o")
    subprocess.run([*arm, *source, here / "startup.c", "-T", here / "mps2.ld", "--specs=rdimon.specs", "-nostartfiles",
                    newlib, *start, "-o", tmp_path / "firmware.elf", "-lm"], check=True)  # fmt: skip
    emulated = subprocess.run(
        ["qemu-system-arm", "-machine", "mps2-an386", "-nographic", "-monitor", "none", "-serial", "none",
         "-semihosting-config", "enable=on,target=native", "-kernel", tmp_path / "firmware.elf"],
        capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    host = subprocess.run([tmp_path / "host"], capture_output=True, text=True, check=True)
    assert len(host.stdout.split()) == 9 and emulated.stdout == host.stdout
