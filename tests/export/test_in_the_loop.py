"""In the loop: friction that is compensated in another engine, and parameters that are learnt as the machine runs."""

import shutil
import subprocess

import numpy as np
import pytest

from tests.export.exporting import model_with
from wheelpend.benchmarks.in_the_loop.observed import Observed
from wheelpend.export.c_target import c_files
from wheelpend.export.exported_model import exported_model
from wheelpend.model.record import Model

pytestmark = pytest.mark.slow


@pytest.mark.extras
@pytest.mark.parametrize("friction", [0.1, 0.5])
def test_compensation_halves_what_friction_does_to_the_pitch_and_starts_no_limit_cycle(friction):
    pytest.importorskip("mujoco")
    from wheelpend.benchmarks.in_the_loop import compensate

    model = model_with("coulomb_drive").with_fit({compensate.FRICTION_SIZE: (1.02 * friction, 0.02 * friction)})
    for command in compensate.PITCH_COMMANDS:
        smooth, rough, helped = (
            compensate.pitch_of(size, known, command, 1)
            for size, known in ((0.0, None), (friction, None), (friction, model))
        )
        assert np.std(helped - smooth) < 0.5 * np.std(rough - smooth)
        assert np.std(helped[-2000:]) < 1.1 * np.std(smooth[-2000:])  # sensors' noise alone moves it


def test_the_identifier_ends_near_the_bound_and_within_the_errors_that_it_says():
    """From a fifth off, after 20 s of the paper's noise, without knowing whether a force acts."""
    from wheelpend.benchmarks.in_the_loop.learn import try_record

    records = [try_record(seed).parameters for seed in (2, 3, 4, 5)]
    known = [n for n in records[0] if n != "X6"]  # whose bound is that of a machine on which no force acts at all
    off = np.array([[(r[n].value - r[n].truth) / r[n].bound for n in known] for r in records])
    own = np.array([[(r[n].value - r[n].truth) / r[n].sigma for n in known] for r in records])
    assert 0.5 < np.sqrt(np.mean(off**2)) < 4.0
    assert 0.1 < np.sqrt(np.mean(own**2)) < 1.5


@pytest.mark.extras
def test_the_identifier_learns_beside_a_random_force_that_nobody_told_it_of():
    """A twentieth of the drive, on the wheel: where it began with a small force in the drive, it ran away."""
    pytest.importorskip("mujoco")
    from wheelpend.benchmarks.hidden_effects.scene import TRUE_PARAMETERS
    from wheelpend.benchmarks.in_the_loop.learn import known_model, learnt_values
    from wheelpend.benchmarks.random_force.machine import rough_log

    exported = exported_model(known_model(Model.default(), TRUE_PARAMETERS), period=0.001)
    truth = np.array([TRUE_PARAMETERS[exported.module.PARAMETERS[i]] for i in exported.learnt])
    for seed in (1, 2):
        log = rough_log("first_order", "wheel", seed).log
        off = np.clip(np.random.default_rng(seed).normal(size=len(truth)), -2.0, 2.0)
        value, sigma = learnt_values(exported, truth * (1.0 + 0.2 * off), log.voltage, log.measured)
        assert np.sqrt(np.mean(((value - truth) / sigma) ** 2)) < 2.0
        assert np.all(np.abs(value / truth - 1.0)[[0, 2, 3, 4, 5]] < 0.1)


def test_a_machine_that_stands_still_is_not_unlearnt():
    """Forgetting stops where nothing is excited: no variance grows beyond its first, and no value runs away."""
    exported = exported_model(model_with("coulomb_drive"), period=0.001)
    begin = exported.parameters[exported.learnt]
    for forgetting in (1.0, 0.999):
        identifier = Observed(exported, begin, forgetting)
        random = np.random.default_rng(1)
        for _ in range(20_000):
            identifier.see(random.normal(size=3) * exported.readings_sigma)
            identifier.go_on(0.0)
        assert np.all(np.diag(identifier.learnt) <= exported.doubt * (1.0 + 1e-9))
        assert np.all(np.isfinite(identifier.parameters)) and np.all(np.isfinite(identifier.now))


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
