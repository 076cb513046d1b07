"""Parameters with standard errors, by the method of one's choice."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from wheelpend import kernels, regression
from wheelpend.failures import Failure, did_you_mean
from wheelpend.logs import Log
from wheelpend.model import Model
from wheelpend.shooting import vector
from wheelpend.study import Study, best_start, fit_model, free_names, known_values, prepare, read_logs

METHODS = ("differentiation", "filtered", "shooting")
PAPER_TAU = (2.25, 6.5)  # s, the paper's Tables 1 and 2


@dataclass(frozen=True)
class Identification:
    """Identified parameters."""

    method: str
    parameters: dict[str, dict]  # name: value, sigma, identifiable
    condition_number: float
    samples: int
    error: float | None  # of the fit in units of σ, for shooting
    noise_floor: float | None
    warnings: tuple[str, ...]
    model: Model = field(repr=False)  # with the identified values
    unit: dict[str, str] = field(repr=False, default_factory=dict)


def identify(
    model: Model,
    logs: Sequence[str | Path | Log],
    *,
    method: str = "shooting",
    tau: tuple[float, float] = PAPER_TAU,
    progress: Callable[[str], None] = lambda text: None,
) -> Identification:
    """Identify the model's parameters from all samples of the logs.

    ``tau`` are the filter's time constants [s] for the method 'filtered'. Raises Failure for an unknown method and for
    logs that cannot be used.
    """
    if method not in METHODS:
        raise Failure(
            f"No method named '{method}'. Known methods: {', '.join(METHODS)}.{did_you_mean(method, METHODS)}"
        )
    return _shoot(model, logs, progress) if method == "shooting" else _regress(model, logs, method, tau, progress)


def _shoot(model: Model, logs: Sequence, progress: Callable[[str], None]) -> Identification:
    from wheelpend.explanation import standard_error

    study = prepare(model, logs, use_all=True)
    progress("finding a start")
    study, start = best_start(study)
    progress("fitting")
    names = free_names(study, model.effects)
    fitted = fit_model(study, start, names)
    lost = {n.split("@")[0] for n in fitted.unidentifiable}
    table = {
        n: {"value": fitted.of_log(0)[n], "sigma": standard_error(study, fitted, n), "identifiable": n not in lost}
        for n in names
    }
    return Identification(
        "shooting", table, fitted.condition, sum(len(p.log) for p in study.training), fitted.error, study.floor,
        (*study.warnings, *_unexcited(lost)), _updated(model, table), _units(study.module),
    )  # fmt: skip


def _regress(model: Model, logs: Sequence, method: str, tau, progress: Callable[[str], None]) -> Identification:
    loaded = read_logs(logs, model)
    if len(loaded) != 1:
        raise Failure(f"The method '{method}' takes one log, but {len(loaded)} were given. Use `--method shooting`.")
    module = kernels.lean(model.plant, model.assumptions, model.effects)
    relative = model.assumptions["encoder"] == "relative"
    parameters = vector(module, known_values(model), loaded[0])
    progress("regression")
    if method == "differentiation":
        fitted = regression.differentiation(module, loaded[0], parameters, relative)
    else:
        fitted = regression.filtered(module, loaded[0], parameters, relative, tau)
    table = {
        n: {"value": float(v), "sigma": float(s), "identifiable": n not in fitted.unidentifiable}
        for n, v, s in zip(fitted.names, fitted.estimate, fitted.sigma, strict=True)
    }
    held = tuple(f"{n} enters nonlinearly; the regression takes it as it stands in the model."
                 for n in module.PARAMETERS[: module.FITTED] if n not in fitted.names)  # fmt: skip
    warnings = (*loaded[0].warnings, *_unexcited(fitted.unidentifiable), *held)
    return Identification(method, table, fitted.condition, len(loaded[0]), None, None, warnings,
                          _updated(model, table), _units(module))  # fmt: skip


def _unexcited(names) -> tuple[str, ...]:
    return tuple(f"{n} is not excited by this log: its value means nothing. Record faster or larger motion."
                 for n in sorted(names))  # fmt: skip


def _units(module) -> dict[str, str]:
    return dict(zip(module.PARAMETERS, module.UNITS, strict=True))


def _updated(model: Model, table: dict[str, dict]) -> Model:
    return model.with_fit({n: (row["value"], row["sigma"]) for n, row in table.items() if row["identifiable"]})


__all__ = ["METHODS", "Identification", "Study", "identify"]
