"""In the loop: friction that is compensated in another engine, and parameters that are learnt as the machine runs."""

import re
import shutil
import subprocess

import numpy as np
import pytest

from tests.export.emulated import SINGLE, emulated, firmware, needs_emulator, sources
from tests.export.exporting import model_with
from tests.support import ROOT
from wheelpend.benchmarks.in_the_loop.observed import Observed
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


@needs_emulator
@pytest.mark.skipif(not shutil.which("gcc"), reason="needs gcc")
def test_a_cortex_m4f_gives_the_bits_of_the_host(tmp_path):
    source = sources(tmp_path, model_with("coulomb_drive", "actuator_delay"), "main.c")
    subprocess.run(["gcc", *SINGLE, *source, "-o", tmp_path / "host"], check=True)
    host = subprocess.run([tmp_path / "host"], capture_output=True, text=True, check=True).stdout
    assert len(host.split()) == 9 and emulated(firmware(tmp_path, source, *SINGLE)) == host


@needs_emulator
def test_no_call_takes_more_instructions_than_the_page_says(tmp_path):
    """Counted by QEMU, which has no wait states; the page's figures, a tenth more."""
    stated = re.findall(r"\| `wp_(\w+)` \| (\d+) \| (\d+) \|", (ROOT / "docs/export_c.md").read_text("utf-8"))
    program = firmware(tmp_path, sources(tmp_path, model_with("coulomb_drive"), "counts.c"), *SINGLE)
    printed = emulated(program, "-icount", "shift=0").splitlines()
    found = {name: (int(mean), int(most)) for name, mean, most in map(str.split, printed)}
    assert sorted(found) == sorted(name for name, *_ in stated)
    for name, mean, most in stated:
        assert 0.8 * int(mean) - 40 < found[name][0] < 1.1 * int(mean) + 40
        assert found[name][1] < 1.1 * int(most) + 40
