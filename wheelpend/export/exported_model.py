"""What an export carries: the model's values and their errors, sizes, and its equations as a program."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from wheelpend.errors import Failure
from wheelpend.estimation.estimate import Covariance
from wheelpend.estimation.free_parameters import known_values
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.random_source import mixing_matrix, noise_array, possible_forces
from wheelpend.estimation.step_size import stable_step
from wheelpend.estimation.stored_sources import stored_sources
from wheelpend.export.translate.idle import without_idle_functions
from wheelpend.export.translate.known import Argument, RuntimeConstant
from wheelpend.export.translate.program import REAL_NUMBER, Kind, Program
from wheelpend.export.translate.specialise import Specialiser
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.kernels.load import load_module, real_time_text
from wheelpend.logs.log import Log
from wheelpend.model.record import Model
from wheelpend.simulation.simulate import noise_levels

# kernels of each part, by their names in an export; read_sensors comes first because the others call it
EXPORT_PARTS: dict[str, dict[str, str]] = {
    "machine": {
        "read_sensors": "read_sensors",
        "start_machine": "start_machine",
        "step_machine": "step_machine",
        "rates_of_machine": "machine_rates",
        "linearise_machine": "linearise_machine",
    },
    "compensator": {"compensated_command": "compensate"},
    "observer": {
        "start_observer": "start_filter",
        "predict_observer": "filter_step",
        "update_observer": "filter_readings",
    },
    "identifier": {
        "start_identifier": "start_filter",
        "predict_identifier": "filter_step",
        "update_identifier": "filter_readings",
        "adapt_identifier": "adapt_filter",
    },
    "modes": {
        "slopes_of_machine": "machine_slopes",
        "reserves_of_machine": "friction_reserves",
        "settle_machine": "settle_friction",
    },
}
LIBRARY_PARTS = ("machine", "compensator", "observer", "identifier")  # what a program on a machine has
LANE_PLACES = ("START", "STAGE", "END", "OWN", "DRIVEN", "EXCESS")  # constants that count in lanes
DEFAULT_PERIOD_S = 0.001  # between samples, where no log says
FURTHEST_DELAY_FACTOR = 1.5  # of the model's own delays, for which commands and readings are kept
LEAST_VALUE_SHARE = 0.05  # of a positive parameter, below which what is learnt does not fall
START_SPREAD = {"rad": 0.1, "m": 0.1, "rad/s": 1.0, "m/s": 1.0}  # standard deviations of a state that is hardly known
UNKNOWN_FORCE, UNKNOWN_FORCE_TIME_S = 0.02, 0.1  # rms in the row's unit and correlation time of a force nobody measured
START_FORCE = 3.0  # least rms of a source, in its unit, where the identifier begins: that of a drive
UNKNOWN_VARIANCE = 1e-4  # of a parameter that is zero, before anything is learnt
START_ERROR_SHARE = 0.3  # of a parameter, its standard deviation before anything is learnt


@dataclass(frozen=True)
class ExportedModel:
    """A model with all its values, ready to be printed in any language."""

    model: Model
    module: KernelModule  # for loops in real time
    text: str  # of that module
    parameters: np.ndarray  # (NP,) values
    sigma: Mapping[str, float]  # standard errors, where there are any
    period: float  # s between samples
    max_step: float  # s
    readings_sigma: np.ndarray  # (NY,) of the sensors' white noise
    warnings: tuple[str, ...] = ()
    fitted_covariance: Covariance | None = None  # of a fit to logs, where a target tells correlations

    @property
    def inputs(self) -> int:
        """Number of inputs."""
        return len(self.module.INPUTS)

    @property
    def size(self) -> int:
        """Number of states with those that effects add (NS)."""
        return self.module.NV + (self.module.LAG >= 0)

    def delay_of(self, place: int) -> float:
        """A delay among the parameters [s]; 0 where there is none."""
        return float(self.parameters[place]) if place >= 0 else 0.0

    @cached_property
    def commands(self) -> int:
        """Number of commands that are kept."""
        return 3 + math.ceil(FURTHEST_DELAY_FACTOR * self.delay_of(self.module.DELAY) / self.period)

    @cached_property
    def late_readings(self) -> int:
        """Number of samples of which late sensors' readings are kept."""
        return 3 + math.ceil(FURTHEST_DELAY_FACTOR * self.delay_of(self.module.SENSOR_DELAY) / self.period)

    @cached_property
    def forces(self) -> np.ndarray:
        """Places of the rows' unknown forces among the parameters."""
        return np.array([self.module.PARAMETERS.index(n) for n in self.module.MISSING_FORCES], dtype=np.int64)

    @cached_property
    def learnt(self) -> np.ndarray:
        """Places of what a recursive identifier learns: the plant's own parameters, and what effects are linear in."""
        names = [n for n in self.module.LINEAR if n in self.sigma] or list(
            self.module.PARAMETERS[: self.module.OWN_PARAMETERS]
        )
        return np.array([self.module.PARAMETERS.index(n) for n in names], dtype=np.int64)

    @cached_property
    def least(self) -> np.ndarray:
        """Values below which what is learnt does not fall (n,); none for those that may be negative."""
        own = self.parameters[self.learnt]
        may_be_negative = [n in self.module.SIGNED or n >= self.module.OWN_PARAMETERS for n in map(int, self.learnt)]
        return np.where(may_be_negative, -np.inf, LEAST_VALUE_SHARE * own)

    @cached_property
    def sources(self) -> tuple:
        """Random forces and errors of sensors that the model knows of; else a small force on each row."""
        single = [
            f for f in possible_forces(self.model.plant_signature, self.module.NY) if np.count_nonzero(f.rows) == 1
        ]
        small = tuple(f.with_noise(UNKNOWN_FORCE, UNKNOWN_FORCE_TIME_S) for f in single)
        return stored_sources(self.model, self.module.OUTPUTS) or small

    @cached_property
    def mixing(self) -> np.ndarray:
        """Weights (rows, m) of the sources on the rows."""
        return mixing_matrix([s.rows for s in self.sources], self.module.NQ)

    @cached_property
    def reads(self) -> np.ndarray:
        """Weights (NY, m) of the sources on the readings."""
        return mixing_matrix([s.readings for s in self.sources], self.module.NY)

    @cached_property
    def noise(self) -> np.ndarray:
        """Rms, correlation time, and 0 (m, 3): a sensor's low-pass filter is not followed in real time."""
        found = noise_array(self.sources)
        found[:, 2] = 0.0
        return found

    @cached_property
    def noise_at_start(self) -> np.ndarray:
        """The same (m, 3) where the identifier begins: forces with room for what its first parameters miss."""
        found = self.noise.copy()
        forces = [np.any(s.rows) for s in self.sources]
        found[forces, 0] = np.maximum(found[forces, 0], START_FORCE)
        return found

    @cached_property
    def doubt(self) -> np.ndarray:
        """Variances (n,) of what is learnt, before anything is."""
        found = (START_ERROR_SHARE * self.parameters[self.learnt]) ** 2
        return np.where(found > 0.0, found, UNKNOWN_VARIANCE)

    @cached_property
    def spread(self) -> np.ndarray:
        """Standard deviations (NS,) of a state that is hardly known."""
        plant = self.model.plant_signature
        units = [START_SPREAD.get(c.unit, 0.1) for c in plant.coordinates]
        rates = [START_SPREAD.get(f"{c.unit}/s", 1.0) for c in plant.coordinates]
        return np.array([*units, *rates] + [0.0] * (self.size - self.module.NX))

    def program(self, parts: Sequence[str] = LIBRARY_PARTS, lanes: int = 0) -> Program:
        """The kernels of these parts that the module has; so many sensitivities side by side, 0 as for a log."""
        constants = {n: v for n, v in vars(self.module).items() if n[:1].isupper()}
        if lanes:
            rows = {n: constants[n] // constants["LANES"] for n in LANE_PLACES}
            constants |= {"LANES": lanes} | {n: lanes * row for n, row in rows.items()}
        made = Specialiser(self.text, constants | {"AT_REST": RuntimeConstant("WP_AT_REST")})
        for part in parts:
            arguments = self.arguments(self.learnt if part == "identifier" else np.zeros(0, np.int64))
            for name, kernel in EXPORT_PARTS[part].items():
                if kernel not in made.sources:
                    continue  # nothing sticks where there is no dry friction
                made.add(kernel, arguments, name)
        return without_idle_functions(made.program)

    def arguments(self, columns: np.ndarray) -> dict[str, Argument]:
        """Arguments of the kernels by name, where the parameters in these columns are learnt."""
        m, n, count = self.module, len(columns), len(self.sources)
        driven = max(self.inputs, 1)
        shapes = {
            "state": (m.NX,), "now": (self.size,), "parameters": (m.NP,), "output": (m.NY,), "rates": (m.NX,),
            "commands": (self.commands,) if self.inputs <= 1 else (self.commands, self.inputs),
            "readings": (self.late_readings, m.NY),
            "by_state": (m.NX, m.NX), "by_input": (m.NX, driven), "reading_by_state": (m.NY, m.NX),
            "forces": (m.NP,), "absent": (m.NP,), "maps": (m.NP,), "shares": (m.HYSTERESES,),
            "spread": (self.size,), "mixing": (m.NQ, count), "reads": (m.NY, count), "noise": (count, 3),
            "sens": (self.size, self.size + m.NQ + n), "force": (count,), "force_by": (count, n),
            "covariance": (self.size + count, self.size + count), "rubbing": (m.SURFACES,),
            "measured": (m.NY,), "weight": (m.NY,), "innovation": (m.NY,), "gate": (m.NY,), "taken": (m.NY,),
            "learnt": (n, n), "least": (n,), "doubt": (n,),
            "directions": (m.SURFACES,), "reserves": (2 * m.SURFACES,), "slope": (self.size,),
        }  # fmt: skip
        numbers = ("t", "h", "period", "max_step", "step", "wanted", "least_slip", "least_input", "forgetting")
        return {
            **{name: Kind("array", shape) for name, shape in shapes.items()},
            **dict.fromkeys(numbers, REAL_NUMBER),
            "voltage": REAL_NUMBER if self.inputs <= 1 else Kind("array", (self.inputs,)),
            "columns": columns,
            "force_columns": self.forces,
        }


def exported_model(model: Model, log: Log | None = None, period: float | None = None) -> ExportedModel:
    """A model with its values, for a machine that is sampled every ``period`` [s], else as the log is, else at 1 kHz.

    Raises Failure where a parameter has no value.
    """
    text = real_time_text(model.plant, model.assumptions, model.effects)
    module = load_module(text, f"{model.plant}_real_time")
    values = known_values(model)
    needed = [*module.PARAMETERS[: module.OWN_PARAMETERS],
              *(n for n in model.effect_values if n in module.PARAMETERS)]  # fmt: skip
    if missing := [n for n in needed if n not in values]:
        raise Failure(f"{', '.join(missing)} must have a value to be exported: identify the model first with "
                      "`wheelpend identify LOG --save`, or give it in [parameters].")  # fmt: skip
    channels = tuple(module.OUTPUTS)
    empty = log or Log("", np.zeros(1), np.zeros(1), np.zeros((1, len(channels))), channels)
    step = period or (log.dt if log else DEFAULT_PERIOD_S)
    known = model.all_parameters
    return ExportedModel(
        model,
        module,
        text,
        kernel_parameters(module, values, empty),
        {n: v.sigma for n, v in known.items() if v.sigma},
        step,
        min(step, stable_step(module, values, empty)),
        _sensor_sigma(model, channels, log),
    )


def _sensor_sigma(model: Model, channels: tuple[str, ...], log: Log | None) -> np.ndarray:
    """Standard deviations (NY,) of the sensors: of the log's where there is one, else as the model states them."""
    if log is not None:
        from wheelpend.estimation.data import prepare  # imported late: only logs need it

        problem: Any = prepare(model, log, use_all=True, lean=True)
        return np.asarray(problem.data.estimation[0].sigma, dtype=float)
    levels = noise_levels(model, channels)
    steps = np.array([model.sensors.step_of(model.plant_signature.channel(c)) or 0.0 for c in channels])
    found = np.hypot(levels, steps / math.sqrt(12.0))
    return np.where(found > 0.0, found, 1e-3)
