"""The methods that the tables compare: each takes a robot and a log and gives X1, X2, ... in order."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from wheelpend.errors import Failure
from wheelpend.estimation.continuation import fit_model, fit_segments
from wheelpend.estimation.criteria import DEFAULT_HORIZON_S
from wheelpend.estimation.least_squares import differentiation_least_squares, filtered_least_squares
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import DataSplit, Segments
from wheelpend.estimation.state_reconstruction import measured_states
from wheelpend.identification.instrumental import IV_TIME_CONSTANTS_S, instrumental_estimate
from wheelpend.logs.log import Log, segment_bounds
from wheelpend.logs.noise import sensor_noise
from wheelpend.paper.numbers import TABLE_1_TAU
from wheelpend.reproduction.experiment import Robot
from wheelpend.simulation.simulate import noise_levels

NOMINAL_FACTOR = 0.9  # times the truth, where an iteration starts
METHOD_LABELS = {
    "differentiation": "differentiation",
    "filtered_zoh": "filtered, ZOH",
    "filtered_foh": "filtered, FOH",
    "iv": "instrumental variables",
    "shooting": "multiple shooting",
    "filtered_rest": "filtered, FOH, from zero",
    "cramer_rao": "Cramér-Rao bound",
}


def differentiation(robot: Robot, log: Log) -> np.ndarray:
    """Least squares with differentiated rates (paper eqs. 16, 17, 24)."""
    return differentiation_least_squares(robot.module, log, parameter_vector(robot, log)).estimate


def filtered(
    robot: Robot,
    log: Log,
    *,
    hold: str = "foh",
    start: np.ndarray | None = None,
    fit_start: bool = False,
    tau: tuple[float, float] = TABLE_1_TAU,
) -> np.ndarray:
    """Filtered least squares, the filters started at a state (NX,), by default the first measured one."""
    begin = None if fit_start else first_sample(robot, log) if start is None else start
    return filtered_least_squares(
        robot.module, log, parameter_vector(robot, log), tau, first_order_hold=hold == "foh", start=begin
    ).estimate


def instrumental(robot: Robot, log: Log) -> np.ndarray:
    """Instruments from the simulated closed loop, started at the model's nominal values; NaN where that fails."""
    try:
        found = instrumental_estimate(
            robot.model, robot.module, log, parameter_vector(robot, log), IV_TIME_CONSTANTS_S, errors=False
        )
    except Failure:
        return np.full(len(robot.names), np.nan)
    return found.fit.estimate


def shooting(robot: Robot, log: Log, nominal: float = NOMINAL_FACTOR) -> np.ndarray:
    """Multiple shooting with the sensors' true noise, started at a multiple of the true values."""
    fitted = fit_model(estimation_problem(robot, log), robot.scaled(nominal), robot.names, horizons=(0.1, 1.0))
    return np.array([fitted.values[n] for n in robot.names])


def cramer_rao(robot: Robot, log: Log) -> np.ndarray:
    """Smallest standard deviation of an unbiased estimator that gives each segment its own initial state.

    From the information matrix at the true parameters.
    """
    problem = estimation_problem(robot, log)
    fitted = fit_segments(problem, problem.data.estimation, robot.values, robot.names, rounds=0)
    return np.sqrt(np.diag(fitted.covariance))


def parameter_vector(robot: Robot, log: Log) -> np.ndarray:
    """Parameter vector of the kernels at the true values; the regressions do not use those that they identify."""
    return kernel_parameters(robot.module, robot.values, log)


def first_sample(robot: Robot, log: Log) -> np.ndarray:
    """The first measured state; the wheel's speed, which no sensor gives, from the first two angles."""
    first, second = measured_states(robot.module, log)[:2]
    rate = robot.module.NQ
    return np.concatenate([first[:rate], [(second[0] - first[0]) / log.dt], first[rate + 1 :]])


def wheel_at_rest(robot: Robot, log: Log) -> np.ndarray:
    """The first measured state with the wheel's speed known to be zero."""
    state = first_sample(robot, log)
    state[robot.module.NQ] = 0.0
    return state


def estimation_problem(robot: Robot, log: Log) -> EstimationProblem:
    """Estimation problem of a log, with the known standard deviations of its sensors."""
    given = {n: s or None for n, s in zip(log.channels, noise_levels(robot.model, log.channels), strict=True)}
    steps = {c.name: robot.model.sensors.step_of(c) for c in robot.model.plant_signature.channels}
    noise = sensor_noise(log, given, steps)
    segments = Segments(log, noise.sigma, np.ascontiguousarray(segment_bounds(log, DEFAULT_HORIZON_S), dtype=np.int64))
    data = DataSplit((segments,), ())
    return EstimationProblem(robot.model, robot.module, data, (noise,), DEFAULT_HORIZON_S, log.dt, ())


def condition_numbers(robot: Robot, log: Log) -> dict[str, tuple[float, float]]:
    """Condition number of ΦᵀΦ per method, as it stands and with the columns of Φ scaled to unit length."""
    module = robot.module
    known, states = parameter_vector(robot, log), measured_states(robot.module, log)
    rates = np.gradient(states[:, module.NQ :], log.t, axis=0)
    rows = [
        module.regressor(t, s, a, v, known)[1] for t, s, a, v in zip(log.t, states, rates, log.voltage, strict=True)
    ]
    start = first_sample(robot, log)
    behind = module.filter_regressor(log.t, states, log.voltage, known, *TABLE_1_TAU, True, start)[1]
    return {
        "differentiation": plain_and_scaled_condition(np.array(rows)),
        "filtered_foh": plain_and_scaled_condition(behind),
    }


def plain_and_scaled_condition(regressor: np.ndarray) -> tuple[float, float]:
    """Condition number of ΦᵀΦ, plain and column-scaled."""
    triangle = np.linalg.qr(regressor.reshape(-1, regressor.shape[-1]), mode="r")
    scaled = triangle / np.linalg.norm(triangle, axis=0)
    return float(np.linalg.cond(triangle)) ** 2, float(np.linalg.cond(scaled)) ** 2


METHOD_ESTIMATORS: dict[str, Callable[[Robot, Log], np.ndarray]] = {
    "differentiation": differentiation,
    "filtered_zoh": lambda robot, log: filtered(robot, log, hold="zoh"),
    "filtered_foh": filtered,
    "iv": instrumental,
    "shooting": shooting,
    "filtered_rest": lambda robot, log: filtered(robot, log, start=np.zeros(robot.module.NX)),
    "filtered_still": lambda robot, log: filtered(robot, log, start=wheel_at_rest(robot, log)),
    "filtered_free": lambda robot, log: filtered(robot, log, fit_start=True),
    "shooting_above": lambda robot, log: shooting(robot, log, 2.0 - NOMINAL_FACTOR),
}
