"""The result of one log of a campaign."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from derive.parameter_name import full_name
from wheelpend.api import diagnose, explain
from wheelpend.campaigns.addresses import fetched, is_address
from wheelpend.diagnosis.compare import compare
from wheelpend.errors import Failure
from wheelpend.estimation.data import read_logs
from wheelpend.estimation.estimate import Covariance
from wheelpend.estimation.estimate import Estimate as ParameterEstimate
from wheelpend.identification.identify import identify
from wheelpend.inspection.inspect import inspect_for_model
from wheelpend.logs.log import Log
from wheelpend.model.record import Model
from wheelpend.model.user_plants import load_plant
from wheelpend.simulation.simulate import simulate

LogSource = str | Path | Log | int  # a measured log, a path or an address, or the seed of a simulated one


class SimulationSpec(NamedTuple):
    """The experiment that is simulated with every seed."""

    command: str
    duration: float | None  # s
    hide: dict[str, float]  # by effect.parameter

    def to_json(self) -> dict[str, Any]:
        """The experiment under the keys of JSON."""
        return {"command": self.command, "duration": self.duration, "hide": self.hide}


class CampaignSetting(NamedTuple):
    """The analysis of every log; can be handed to another process."""

    text: str  # of the model.toml
    path: Path | None  # of that file, beside which effects.toml is
    plant: Path | None  # file of a plant of the user's own
    do: str
    method: str = "filter_error"  # of identify
    tau: tuple[float, ...] | Literal["auto"] | None = None  # s, of identify
    played: SimulationSpec | None = None


class Estimate(NamedTuple):
    """A parameter as one log has it."""

    value: float
    sigma: float | None  # standard error

    def to_json(self) -> dict[str, Any]:
        """The estimate under the keys of JSON."""
        return {"value": self.value, "sigma": self.sigma}


class ErrorCovariance(NamedTuple):
    """Covariance of a log's estimates."""

    names: tuple[str, ...]
    matrix: tuple[tuple[float, ...], ...]  # (names, names)

    @staticmethod
    def of(found: Covariance | None) -> ErrorCovariance | None:
        """The covariance of an identification, which may have none."""
        if found is None:
            return None
        return ErrorCovariance(tuple(found.names), tuple(map(tuple, np.asarray(found.matrix).tolist())))

    def to_json(self) -> dict[str, Any]:
        """The covariance under the keys of JSON."""
        return {"names": self.names, "matrix": self.matrix}


class NamedEffect(NamedTuple):
    """An effect that is said to be missing."""

    effect: str
    equivalent_to: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """The effect under the keys of JSON."""
        return {"effect": self.effect, "equivalent_to": self.equivalent_to}


@dataclass(frozen=True)
class LogResult:
    """Verdict, errors and parameters of one log, or why it could not be used."""

    log: str  # its file, or the seed
    seed: int | None = None
    failure: str | None = None
    verdict: str | None = None  # of diagnose and explain
    named: tuple[NamedEffect, ...] = ()  # the first effect of diagnose, those that explain added
    effects: tuple[str, ...] = ()  # of the model that the parameters belong to
    error: float | None = None  # of the model as it is, refitted where parameters are fitted
    error_after: float | None = None  # with what was named
    noise_floor: float | None = None
    fit_percent: dict[str, float] = field(default_factory=dict)  # of compare, by channel
    parameters: dict[str, Estimate] = field(default_factory=dict)  # identifiable ones
    covariance: ErrorCovariance | None = None  # of identify: of its parameters' estimates
    warnings: tuple[str, ...] = ()
    unit: str = ""  # as a manifest states it
    date: str = ""  # likewise
    conditions: dict[str, str] = field(default_factory=dict)  # further columns of the manifest

    def to_json(self) -> dict[str, Any]:
        """The result under the keys of JSON."""
        return {
            "log": self.log,
            "seed": self.seed,
            "failure": self.failure,
            "verdict": self.verdict,
            "named": self.named,
            "effects": self.effects,
            "error": self.error,
            "error_after": self.error_after,
            "noise_floor": self.noise_floor,
            "fit_percent": self.fit_percent,
            "parameters": self.parameters,
            "covariance": self.covariance,
            "warnings": self.warnings,
            "unit": self.unit,
            "date": self.date,
            "conditions": self.conditions,
        }


def analyse_log(setting: CampaignSetting, source: LogSource) -> LogResult:
    """Analyse one log; any error becomes the failure of its result."""
    begin = empty_result(source)
    try:
        model = parsed_model(setting.text, setting.path, setting.plant)
        log, warnings = load_or_simulate(model, setting, source)
        return LOG_ANALYSES[setting.do](replace(begin, warnings=warnings), model, log, setting)
    except Exception as error:  # the other logs are still usable
        text = str(error) if isinstance(error, Failure) else f"{type(error).__name__}: {error}"
        return replace(begin, failure=text.removeprefix(f"{Path(begin.log).name}: "))


def empty_result(source: LogSource) -> LogResult:
    """The result of a log before its analysis."""
    if isinstance(source, int):
        return LogResult(f"seed {source}", source)
    return LogResult(source.name if isinstance(source, Log) else str(source))


@lru_cache(maxsize=1)
def parsed_model(text: str, path: Path | None, plant: Path | None) -> Model:
    """The model, parsed once in every process."""
    if plant is not None:
        load_plant(plant)
    return Model.parse(text, path)


def load_or_simulate(model: Model, setting: CampaignSetting, source: LogSource) -> tuple[Log, tuple[str, ...]]:
    """A log, and the warnings about a measured one."""
    if isinstance(source, int):
        assert setting.played is not None, "a seed belongs to something that is simulated"
        return simulate_log(model, setting.played, source), ()
    with fetched(source) if is_address(source) else nullcontext(source) as here:
        log = read_logs([here], model)[0]
    further = (f.sentence for f in inspect_for_model(model, log).findings if not log.has_said(f.sentence))
    return log, (*log.warnings, *further)


def simulate_log(model: Model, experiment: SimulationSpec, seed: int) -> Log:
    """A simulated log."""
    return simulate(model, command=experiment.command, duration=experiment.duration, hide=experiment.hide, seed=seed)


# ---- the analyses


def identify_log(begin: LogResult, model: Model, log: Log, setting: CampaignSetting) -> LogResult:
    """Parameters; without a bias test, as bias shows over the logs of the campaign."""
    result = identify(model, [log], method=setting.method, tau=setting.tau, test_bias=False)
    further = (w for w in result.warnings if w.removeprefix(f"{log.name}: ") not in begin.warnings)
    return replace(
        begin,
        effects=model.effects,
        error=result.error,
        noise_floor=result.noise_floor,
        parameters=identifiable_estimates(result.parameters),
        covariance=ErrorCovariance.of(result.covariance),
        warnings=(*begin.warnings, *further),
    )


def compare_log(begin: LogResult, model: Model, log: Log, setting: CampaignSetting) -> LogResult:
    """Prediction errors of the model on the log."""
    result = compare(model, [log])
    return replace(
        begin,
        effects=model.effects,
        error=result.error,
        noise_floor=result.noise_floor,
        fit_percent=result.fit_percent,
    )


def diagnose_log(begin: LogResult, model: Model, log: Log, setting: CampaignSetting) -> LogResult:
    """The verdict, and the size of the first candidate."""
    result = diagnose(model, [log])
    first = result.named[:1]
    return replace(
        begin,
        verdict=result.verdict,
        named=tuple(NamedEffect(t.effect, t.equivalent_to) for t in first),
        effects=(*model.effects, *(t.effect for t in first)),
        error=result.error,
        error_after=first[0].error_after if first else None,
        noise_floor=result.noise_floor,
        parameters={full_name(t.effect, n): Estimate(e.value, e.sigma) for t in first for n, e in t.estimates.items()},
    )


def explain_log(begin: LogResult, model: Model, log: Log, setting: CampaignSetting) -> LogResult:
    """All effects that were added, and the parameters of the model with them."""
    result = explain(model, [log])
    return replace(
        begin,
        verdict=result.verdict,
        named=tuple(NamedEffect(s.effect, s.equivalent_to) for s in result.steps),
        effects=result.effects,
        error=result.base_error,
        error_after=result.error,
        noise_floor=result.noise_floor,
        parameters=identifiable_estimates(result.parameters),
    )


def identifiable_estimates(parameters: Mapping[str, ParameterEstimate]) -> dict[str, Estimate]:
    """The parameters that a log identifies."""
    return {n: Estimate(e.value, e.sigma) for n, e in parameters.items() if e.identifiable}


LOG_ANALYSES: dict[str, Callable[[LogResult, Model, Log, CampaignSetting], LogResult]] = {
    "identify": identify_log,
    "compare": compare_log,
    "diagnose": diagnose_log,
    "explain": explain_log,
}
