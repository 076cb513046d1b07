"""Which experiment would tell two effects apart, computed from the information a command would give."""

from __future__ import annotations

import numpy as np

import derive
from wheelpend.commands import COMMANDS, reference
from wheelpend.fitting import layout, reduce
from wheelpend.logs import Log, segment_bounds
from wheelpend.screening import project
from wheelpend.shooting import Part, fit_states, shoot, vector
from wheelpend.study import Study

CLEAR = 5.0  # standard errors at which two effects count as separated


def advice(study: Study, first) -> str:
    """A sentence on what would separate the first candidate from its equivalents."""
    names = [first.effect, *first.equivalent_to]
    if len(names) > 4:
        return (f"More than three effects fit this log equally well ({', '.join(names)}): it moves too little to tell. "
                "Record a longer log with larger and faster motion.")  # fmt: skip
    if study.model.controller is None:
        return (
            f"Record a second log in which {' and '.join(names)} would act differently: turn the robot round, change "
            "the speed range, or move on level ground. With a [controller], commands are compared."
        )
    others = [separations(study, first, command, names) for command in sorted(COMMANDS)]
    best = max(others, key=lambda pair: pair[1])
    if best[1] < CLEAR:
        return (f"No command of these sensors separates {' from '.join(names)}: they change every log in the same way. "
                "Turn the sensor or the robot round, or measure one of them by other means.")  # fmt: skip
    return (f"Record 20 s of the command '{best[0]}': it would separate {' from '.join(names)} "
            f"by {best[1]:.0f} standard errors.")  # fmt: skip


def separations(study: Study, first, command: str, names: list[str]) -> tuple[str, float]:
    """By how many standard errors a command would separate the first candidate from the closest of the others."""
    log, states, parameters = _rehearse(study, first, command)
    part = Part(log, study.noise[0].sigma, np.ascontiguousarray(segment_bounds(log, study.horizon)))
    module = study.module
    free = [*study.base, *(f"{e}.{p.name}" for e in names for p in derive.effects.find(e).sizes)]
    plan = layout(free, (), 1)
    own, _ = fit_states(module, part, states[part.bounds[:, 0]], parameters, study.max_step, rounds=1)
    shot = shoot(module, part, own, parameters, [module.PARAMETERS.index(n) for n in free], max_step=study.max_step)
    reduced = reduce([shot], module.NX, plan)
    lead = [k for k, n in enumerate(free) if n.startswith(f"{first.effect}.")]
    weakest = np.inf
    for other in names[1:]:
        rest = [k for k, n in enumerate(free) if n in study.base or n.startswith(f"{other}.")]
        information, _ = project(reduced.information, reduced.score, rest)
        size = np.array([first.coefficients[free[k].partition(".")[2]] for k in lead])
        weakest = min(weakest, float(np.sqrt(max(size @ information[np.ix_(lead, lead)] @ size, 0.0))))
    return command, weakest


def _rehearse(study: Study, first, command: str) -> tuple[Log, np.ndarray, np.ndarray]:
    """Simulate a command with the first candidate in the model and without noise."""
    module, fitted, controller = study.module, first.fit, study.model.controller
    assert controller is not None, "a command needs a controller"
    t = np.arange(0.0, 20.0, 0.001)
    angle, rate = reference(command, t)
    log = Log(command, t, np.zeros_like(t), np.zeros((len(t), module.NY)), tuple(module.OUTPUTS))
    parameters = vector(module, fitted.of_log(0), log)
    gains = np.array(controller.gains, dtype=float)
    states, measured, voltage = module.closed_loop(
        t,
        angle,
        rate,
        gains,
        np.zeros(module.NX),
        parameters,
        np.zeros((len(t), module.NY)),
        np.zeros(module.NY),
        0.002,
    )
    return Log(command, t, voltage, measured, tuple(module.OUTPUTS), angle), states, parameters
