"""The work whose growth is measured, made ready for a size: a warm-up and the work itself.

Imports of the tool are late, so that a process has loaded only what its own work needs when its memory is measured.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from derive.effects import Effect
    from wheelpend.logs.log import Log

WARM_UP_SAMPLES = 20_000  # on which work is done once before it is measured
DIAGNOSIS_DURATION_S = 20.0  # of the log that is diagnosed with more and more effects
BATCH_DURATION_S, BATCH_MAX_STEP_S = 2.0, 1e-3
BATCH_RECORD_INTERVAL_SAMPLES = 100
USER_EFFECT_TEMPLATE = """[drag_{number}]
family = "drive"
sentence = "A drag that grows with a power of the speed."
on = "drive"
law = "size*speed*abs(speed/20)^{power}"
[drag_{number}.parameters]
size = {{ unit = "V s/rad", typical = 0.1 }}
"""


class Work(NamedTuple):
    """Work of one size."""

    warm_up: Callable[[], object]  # loads and compiles everything that the work needs
    run: Callable[[], object]


def write_log(folder: Path, samples: int) -> None:
    """Write a long log of the paper's robot, as arrays on disk."""
    from wheelpend.model.record import Model  # late: see above
    from wheelpend.simulation.simulate import SAMPLE_INTERVAL_S, simulate

    log = simulate(Model.default(), duration=(samples - 1) * SAMPLE_INTERVAL_S, seed=1)
    for name in ("t", "voltage", "measured"):
        getattr(log, name).tofile(folder / name)


def read_log(folder: Path, samples: int) -> Log:
    """The first samples of the long log."""
    from wheelpend.logs.log import Log  # late: see above

    t, voltage = (np.fromfile(folder / name, count=samples) for name in ("t", "voltage"))
    measured = np.fromfile(folder / "measured", count=3 * samples).reshape(-1, 3)
    return Log("long", t, voltage, measured, channels=("theta_w", "theta_p", "dtheta_p"))


def identification(method: str, size: int, folder: Path) -> Work:
    """Identification of the paper's model from so many samples."""
    from wheelpend import Model, identify  # late: see above

    model, log = Model.default(), read_log(folder, size)

    def run(samples: int) -> None:
        identify(model, [log.part(0, samples)], method=method, test_bias=False)

    return Work(lambda: run(min(size, WARM_UP_SAMPLES)), lambda: run(size))


def diagnosis(size: int, folder: Path) -> Work:
    """Diagnosis from so many samples."""
    from wheelpend import Model, diagnose  # late: see above

    model, log = Model.default(), read_log(folder, size)
    return Work(lambda: diagnose(model, [log.part(0, min(size, WARM_UP_SAMPLES))]), lambda: diagnose(model, [log]))


def diagnosis_of_effects(size: int, folder: Path) -> Work:
    """Diagnosis with so many candidate effects; beyond the library's there are drags of further powers."""
    from wheelpend import Model, diagnose  # late: see above
    from wheelpend.model import workspace
    from wheelpend.simulation.simulate import simulate

    place = folder / f"effects_{size}"
    model = workspace.create(place, "wheel_pendulum")
    library = library_effects()
    known = [e.name for e in library if not e.event and not e.releases]
    if size > len(known):
        rows = [USER_EFFECT_TEMPLATE.format(number=n, power=2 + n) for n in range(size - len(known))]
        (place / "effects.toml").write_text("\n".join(rows), encoding="utf-8")
        model = Model.open(place)
    left_out = [e.name for e in library if e.name not in known[:size]]
    log = simulate(Model.default(), duration=DIAGNOSIS_DURATION_S, hide={"coulomb_drive": 0.3}, seed=1)

    def run() -> None:
        diagnose(model, [log], without=[n for n in left_out if n != "coulomb_drive"])

    return Work(run, run)


def library_effects() -> tuple[Effect, ...]:
    """The library's effects on the paper's plant."""
    import derive  # late: see above
    from wheelpend.kernels.plant_signature import plant_signature

    signature = plant_signature("wheel_pendulum", derive.plants.complete_assumptions("wheel_pendulum", {}))
    return tuple(derive.effects.applicable_to(signature))


def batch(size: int, folder: Path) -> Work:
    """So many closed loops side by side."""
    from wheelpend.benchmarks.speed.setting import Setting  # late: see above

    setting = Setting(peers=Path())
    loop, module = setting.loop(BATCH_DURATION_S), setting.lean
    ones = np.ones((size, 1))
    record = np.zeros((len(loop.t) // BATCH_RECORD_INTERVAL_SAMPLES + 1, module.NX + 1, size))

    def run(count: int) -> None:
        module.closed_loop_batch(
            loop.t, loop.reference, loop.rate, ones[:count] * loop.gains, ones[:count] * loop.state,
            ones[:count] * loop.parameters, BATCH_MAX_STEP_S, BATCH_RECORD_INTERVAL_SAMPLES,
            record[:, :, :count].copy(),
        )  # fmt: skip

    return Work(lambda: run(1), lambda: run(size))


WORK_FACTORIES: dict[str, Callable[[int, Path], Work]] = {
    "identify of samples": partial(identification, "shooting"),
    "identify --method filtered of samples": partial(identification, "filtered"),
    "diagnose of samples": diagnosis,
    "diagnose of effects": diagnosis_of_effects,
    "closed_loop_batch of machines": batch,
}
