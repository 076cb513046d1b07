"""What is drawn of a bench: the machine, its command, its sensor and what a plain model of it lacks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from wheelpend.benchmarks.benches.machines import Bench, counted, motion
from wheelpend.benchmarks.benches.robot_cases import balancing
from wheelpend.logs.log import Log
from wheelpend.model.record import Model

DEFAULT_COUNT = 120
MACHINE_KINDS = ("swing", "motor", "driven pendulum", "coasting motor", "balancing robot")  # in turn
KIND_MODELS = {
    "swing": 'plant = "pendulum"\n',
    "motor": 'plant = "shaft"\n',
    "coasting motor": 'plant = "shaft"\n',
    "driven pendulum": 'plant = "pendulum"\n[assumptions]\ndriven = true\n',
    "balancing robot": 'plant = "wheel_pendulum"\n[sensors]\nencoder = "relative"\n',
}
RATES_HZ, SPANS_S, ENCODER_COUNTS = (50.0, 100.0, 200.0, 500.0), (4.0, 6.0, 10.0, 15.0), (400, 1024, 2048, 4096, 0)
NOISE_RAD = 0.001  # of a sensor that is no encoder
COMMAND_KINDS = ("steps", "sine", "chirp", "ramps")
FIRST_SEED = 41_000  # of the logs, no others are drawn from these


@dataclass(frozen=True)
class Case:
    """A log to be made: its number says all of it."""

    number: int

    @property
    def kind(self) -> str:
        """What machine it is of."""
        return MACHINE_KINDS[self.number % len(MACHINE_KINDS)]

    @property
    def key(self) -> str:
        """Name of the log."""
        return f"{self.number:03d} {self.kind}"

    @property
    def model(self) -> Model:
        """The plain model of the machine."""
        return Model.parse(KIND_MODELS[self.kind])


@dataclass(frozen=True)
class Made:
    """A log with what a plain model of its machine lacks: parameters by full name."""

    log: Log
    hidden: dict[str, float] = field(default_factory=dict)


def plan(count: int) -> list[Case]:
    """So many cases, of all kinds in turn."""
    return [Case(number) for number in range(count)]


def made(case: Case) -> Made:
    """The log of a case, and what is hidden in it."""
    rng = np.random.default_rng(FIRST_SEED + case.number)
    if case.kind == "balancing robot":
        robot = balancing(rng)
        log = Log(case.key, robot.t, robot.voltages, robot.readings, ("theta_w", "theta_p", "dtheta_p"))
        return Made(log, robot.hidden)
    rate, span, counts = (float(rng.choice(RATES_HZ)), float(rng.choice(SPANS_S)), int(rng.choice(ENCODER_COUNTS)))
    t = np.arange(round(rate * span)) / rate
    angles, drive, hidden = _swung(rng, rate, t) if case.kind == "swing" else _driven(rng, case.kind, rate, t)
    seen = counted(angles, counts) if counts else angles + NOISE_RAD * rng.standard_normal(t.size)
    channel = "theta_m" if "motor" in case.kind else "theta_1"
    return Made(Log(case.key, t, drive, seen[:, None], (channel,), rates={}), hidden)


def _swung(rng: np.random.Generator, rate: float, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, dict[str, float]]:
    """A link let go: its angles, no drive and what is hidden."""
    begin, frequency = float(rng.choice([0.1, 0.4, 1.0, 1.8])), rng.uniform(4.0, 10.0)
    sizes = {
        "viscous_drive.coefficient": (0.6, rng.uniform(0.001, 0.005)),
        "coulomb_drive.torque": (0.5, rng.uniform(0.003, 0.012) * begin),
        "quadratic_drive.coefficient": (0.25, rng.uniform(0.0003, 0.001)),
        "encoder_zero.bias": (0.6, rng.normal(0.0, 0.02)),
    }
    hidden = _chosen(rng, sizes)
    bench = Bench(frequency**-2, 1.0, *_frictions(hidden))
    return motion(bench, 1.0 / rate, np.zeros(t.size), begin) + hidden.get("encoder_zero.bias", 0.0), 0.0 * t, hidden


def _driven(
    rng: np.random.Generator, kind: str, rate: float, t: np.ndarray
) -> tuple[np.ndarray, np.ndarray, dict[str, float]]:
    """A motor's shaft, or a link that it drives: angles, the command and what is hidden."""
    limit = float(rng.choice([3.0, 6.0, 12.0]))
    command, rows = _command(rng, limit, rate, t), int(rng.integers(1, 4))
    sizes = {
        "coulomb_drive.torque": (0.6, limit * rng.uniform(0.03, 0.25)),
        "actuator_delay.delay": (0.25, rows / rate),
        "voltage_saturation.limit": (0.15, limit * rng.uniform(0.5, 0.8)),
        "quadratic_drive.coefficient": (0.2, rng.uniform(0.1, 0.5)),
        "encoder_zero.bias": (0.4, rng.normal(0.0, 0.03)),
    }
    del sizes["quadratic_drive.coefficient" if kind == "driven pendulum" else "encoder_zero.bias"]
    hidden = _chosen(rng, sizes)
    if kind != "driven pendulum":
        back_emf = rng.uniform(0.02, 0.3)
        inertia, weight = back_emf * rng.uniform(0.03, 0.3), 0.0
        if drag := hidden.get("quadratic_drive.coefficient"):  # a share of the back-EMF at full speed
            hidden["quadratic_drive.coefficient"] = drag * back_emf**2 / limit
    else:
        weight = limit * rng.uniform(0.3, 1.2)
        back_emf, inertia = weight * rng.uniform(0.01, 0.08), weight / rng.uniform(4.0, 9.0) ** 2
    acting = np.concatenate([np.zeros(rows), command])[: t.size] if "actuator_delay.delay" in hidden else command
    most = hidden.get("voltage_saturation.limit", np.inf)
    _, dry, quadratic = _frictions(hidden)
    bench = Bench(inertia, weight, back_emf, dry, quadratic)
    if kind == "coasting motor":
        supply = limit * rng.uniform(1.0, 1.3)
        bench = replace(bench, viscous=rng.uniform(0.05, 0.5) * back_emf, back_emf=back_emf, supply=supply)
        hidden["coasting_driver.rate"] = back_emf / supply
    angles = motion(bench, 1.0 / rate, np.clip(acting, -most, most))
    return angles + hidden.get("encoder_zero.bias", 0.0), command, hidden


def _chosen(rng: np.random.Generator, sizes: dict[str, tuple[float, float]]) -> dict[str, float]:
    """Of parameters with their chance and size, those that are there."""
    return {name: float(size) for name, (chance, size) in sizes.items() if rng.random() < chance}


def _frictions(hidden: dict[str, float]) -> Sequence[float]:
    names = ("viscous_drive.coefficient", "coulomb_drive.torque", "quadratic_drive.coefficient")
    return [hidden.get(name, 0.0) for name in names]


def _command(rng: np.random.Generator, limit: float, rate: float, t: np.ndarray) -> np.ndarray:
    """A voltage (N,) that begins at zero, as that of a bench does."""
    kind, begin = str(rng.choice(COMMAND_KINDS)), 0.3
    if kind == "steps":
        hold = round(rate * rng.uniform(0.3, 1.0))
        values = limit * np.repeat(rng.uniform(-1.0, 1.0, t.size // hold + 1), hold)[: t.size]
    elif kind == "sine":
        values = limit * np.sin(2 * np.pi * rng.uniform(0.3, 1.5) * (t - begin))
    elif kind == "chirp":
        values = limit * np.sin(2 * np.pi * (0.2 * (t - begin) + (t - begin) ** 2 / t[-1]))
    else:
        values = limit * (2 * np.abs(2 * (((t - begin) / 4 + 0.25) % 1) - 1) - 1)
    return np.where(t < begin, 0.0, values)
