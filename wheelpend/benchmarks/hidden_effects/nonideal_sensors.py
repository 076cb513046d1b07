"""Logs of a complete model whose sensors and clock are not ideal: colour, heavy tails, few counts, jitter."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

import numpy as np

from wheelpend.errors import Failure, did_you_mean
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.logs.log import Log
from wheelpend.model import model_kernels
from wheelpend.model.record import Model
from wheelpend.simulation.closed_loop import ClosedLoop
from wheelpend.simulation.hidden import machine_values
from wheelpend.simulation.references import reference
from wheelpend.simulation.simulate import noise_levels

FINE_ENCODER_COUNTS, COARSE_ENCODER_COUNTS = 60000, 2000  # per revolution, of the paper's encoder and a coarse one
OUTLIER_SHARE = 0.005  # share of readings that are off by ten standard deviations
ErrorGenerator = Callable[[np.random.Generator, int, float], np.ndarray]  # generator, samples, interval [s]: (samples,)


def white(random: np.random.Generator, samples: int, dt: float) -> np.ndarray:
    """Gaussian, independent from sample to sample."""
    return random.normal(size=samples)


def coloured(time: float) -> ErrorGenerator:
    """Gaussian noise of unit variance with a correlation time [s]: a first-order autoregression."""

    def errors(random: np.random.Generator, samples: int, dt: float) -> np.ndarray:
        share = np.exp(-dt / time)
        found = random.normal(size=samples)
        found[1:] *= np.sqrt(1.0 - share**2)
        for k in range(1, samples):
            found[k] += share * found[k - 1]
        return found

    return errors


def white_plus_slow(slow: ErrorGenerator, size: float) -> ErrorGenerator:
    """White noise of unit variance plus ``size`` times a slow error."""
    return lambda random, samples, dt: white(random, samples, dt) + size * slow(random, samples, dt)


def student(random: np.random.Generator, samples: int, dt: float) -> np.ndarray:
    """Student's t with 3 degrees of freedom, of unit variance."""
    return random.standard_t(3, size=samples) / np.sqrt(3.0)


def outliers(random: np.random.Generator, samples: int, dt: float) -> np.ndarray:
    """Gaussian of unit variance, with a share of OUTLIER_SHARE ten times as large."""
    return np.where(random.random(samples) < OUTLIER_SHARE, 10.0, 1.0) * random.normal(size=samples)


SENSOR_KINDS: dict[str, dict[str, ErrorGenerator]] = {  # errors of a channel in standard deviations; white where absent
    "white": {},
    "pitch coloured, 10 ms": {"theta_p": coloured(0.01)},
    "gyro coloured, 5 ms": {"dtheta_p": coloured(0.005)},
    "pitch wanders, 0.5 s": {"theta_p": white_plus_slow(coloured(0.5), 0.3)},
    "pitch wanders, 0.1 s": {"theta_p": white_plus_slow(coloured(0.1), 0.5)},
    "coarse encoder": {},
    "Student t": {"theta_p": student, "dtheta_p": student},
    "outliers": {"theta_p": outliers, "dtheta_p": outliers},
    "jittered clock": {},
}


def complete_log(
    kind: str,
    seed: int,
    *,
    duration: float = 10.0,
    sample: float = 0.002,
    command: str = "aggressive",
    hide: Mapping[str, float] | None = None,
) -> tuple[Model, Log]:
    """The paper's robot, with nothing hidden unless asked for, measured by sensors of a kind; and its model."""
    if kind not in SENSOR_KINDS:
        raise Failure(
            f"No kind of sensors named '{kind}'. Known: {', '.join(SENSOR_KINDS)}.{did_you_mean(kind, SENSOR_KINDS)}"
        )
    model, random = Model.default(), np.random.default_rng(seed)
    counts = COARSE_ENCODER_COUNTS if kind == "coarse encoder" else FINE_ENCODER_COUNTS
    model = Model.parse(re.sub(r"(?m)^encoder_counts = \S+", f"encoder_counts = {counts}", model.text))
    module = model_kernels.library_module_of(model)
    t = np.arange(round(duration / sample) + 1) * sample
    if kind == "jittered clock":
        t[1:-1] += random.uniform(-0.3, 0.3, size=len(t) - 2) * sample
    drawn = [SENSOR_KINDS[kind].get(c, white)(random, len(t), sample) for c in module.OUTPUTS]
    noise = np.column_stack(drawn) * noise_levels(model, module.OUTPUTS)
    quantum = np.array([2 * np.pi / counts if c == "theta_w" else 0.0 for c in module.OUTPUTS])
    angle, rate = reference(command, t)
    blank = Log("", t, t, np.zeros((len(t), module.NY)), tuple(module.OUTPUTS))
    parameters = kernel_parameters(module, machine_values(model, hide or {}), blank)
    run = ClosedLoop.of(model, module, sample).play(t, angle, rate, np.zeros(module.NX), parameters, noise, quantum)
    return model, Log(f"{kind}, {seed}", t, run.input, run.measured, tuple(module.OUTPUTS), angle)
