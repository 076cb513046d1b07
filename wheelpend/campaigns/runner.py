"""All logs of a campaign, analysed on all cores."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from wheelpend.campaigns.addresses import is_address
from wheelpend.campaigns.cluster import analyses_as_completed
from wheelpend.campaigns.manifest import Listed, listed_logs
from wheelpend.campaigns.one_log import (
    LOG_ANALYSES,
    CampaignSetting,
    LogResult,
    SimulationSpec,
    simulate_log,
)
from wheelpend.campaigns.result_set import ResultSet, question_of
from wheelpend.campaigns.summary import Summary, summarise
from wheelpend.campaigns.units import UnitsAnswer, units_answer
from wheelpend.durations import StepTimer
from wheelpend.errors import Failure, OutOfRange, did_you_mean
from wheelpend.identification.method_options import METHOD_NAMES, check_tau
from wheelpend.logs.read import load_log
from wheelpend.logs.sources import LogLike, LogsLike, as_list, names_of
from wheelpend.model import precompile
from wheelpend.model.record import Model
from wheelpend.model.user_plants import plant_file
from wheelpend.simulation.hidden import with_full_parameter_names

Progress = Callable[[str], None]
MAX_SEED = 2**63
FURTHER_ANALYSES = ("diagnose", "explain")


@dataclass(frozen=True)
class Campaign:
    """Results of the same analysis of many logs."""

    do: str
    method: str | None  # of identify
    simulated: SimulationSpec | None
    logs: Sequence[LogResult]  # of a run that keeps them: read from its files as they are asked for
    summary: Summary
    model: Model = field(repr=False)
    fleet: UnitsAnswer | None = None  # of the units that a manifest states
    then: Campaign | None = None  # another analysis, of the logs of the units that stand out

    def to_json(self) -> dict[str, Any]:
        """The result under the keys of JSON."""
        return {
            "do": self.do,
            "method": self.method,
            "simulated": self.simulated,
            "logs": self.logs,
            "summary": self.summary,
            "fleet": self.fleet,
            "then": self.then,
        }


def campaign(
    model: Model,
    logs: LogsLike | Sequence[Listed] = (),
    *,
    seeds: Collection[int] = (),
    command: str = "aggressive",
    duration: float | None = None,
    hide: Mapping[str, float] | None = None,
    do: str = "identify",
    method: str = "filter_error",
    tau: Sequence[float] | Literal["auto"] | None = None,
    keep: Path | None = None,
    differ: Sequence[str] = (),
    then: str | None = None,
    scheduler: str | None = None,
    progress: Progress = lambda text: None,
) -> Campaign:
    """Identify, compare, diagnose or explain every log by itself, measured ones or one simulated with each seed.

    ``command``, ``duration`` [s] and ``hide`` are those of ``simulate``, ``method`` and ``tau`` [s] those of
    ``identify``. A path, or an address that fsspec knows, may be a pattern, or a manifest: a CSV or Parquet table with
    a column ``log``, and ``unit``, ``date`` or both, in which case the result says what the units have in common, which
    stand out and, of the two that ``differ`` names, why they do. ``then`` is a further analysis, diagnose or explain,
    of the logs of those that stand out.
    A log that cannot be used has a failure in its result, and the others go on; one in memory is refused at once.
    ``keep`` is a folder for the results, a Parquet data set: a log that was asked the same before costs nothing, and an
    interrupted campaign goes on. The logs are analysed on a Dask cluster of this machine's cores, or on that of a
    ``scheduler``, an address which is trusted with code; a script that calls this needs the usual
    ``if __name__ == "__main__":``.
    Raises Failure for an analysis that no log could pass.
    """
    simulated = SimulationSpec(command, duration, with_full_parameter_names(hide or {})) if seeds else None
    listed = listed_sources(as_list(logs))  # type: ignore[arg-type]
    sources = check_sources(model, listed, seeds)
    if (differ or then) and not any(found.unit for found in listed):
        raise Failure(f"--{'differ' if differ else 'then'} is about units, so a manifest must state of which unit each "
                      "log is. Name one.")  # fmt: skip
    setting = CampaignSetting(
        model.text, model.path, plant_file(model.plant), do, method, _time_constants(tau), simulated
    )
    further = check_setting(setting, then)

    def results_of(asked: CampaignSetting, some: Sequence[Listed]) -> Sequence[LogResult]:
        return analyse_logs(model, asked, some, ResultSet(keep, question_of(asked, model)), progress, scheduler)

    results, identified = results_of(setting, sources), method if do == "identify" else None
    answer, summary = units_answer(results, differ), summarise(model, simulated, results)
    found = Campaign(do, identified, simulated, results, summary, model, answer)
    if further is None or answer is None:
        return found
    odd = set(answer.standing_out)
    theirs = [source for source in sources if source.unit in odd]
    lacks = results_of(further, theirs) if theirs else ()
    then_summary = summarise(model, None, lacks)
    return replace(found, then=Campaign(further.do, None, None, lacks, then_summary, model, units_answer(lacks)))


def listed_sources(given: Sequence[LogLike | Listed]) -> list[Listed]:
    """Logs with what is stated of them; manifests and patterns become the logs that they stand for."""
    found: list[Listed] = []
    for one in given:
        if isinstance(one, (str, Path)):
            found += listed_logs([one])
        else:
            found.append(one if isinstance(one, Listed) else Listed(one))
    return found


def check_sources(model: Model, listed: Sequence[Listed], seeds: Collection[int]) -> list[Listed]:
    """Measured logs or seeds; raises Failure unless they are of one kind, and each there once.

    What is in memory becomes a log here; files are read by the process that analyses them.
    """
    if bool(listed) == bool(seeds):
        raise Failure("A campaign must have measured logs or the seeds of simulated ones, not "
                      f"{'both' if listed else 'neither'}.")  # fmt: skip
    logs = [found.log for found in listed]
    given = [log if is_address(log) else os.path.realpath(log) for log in logs if isinstance(log, (str, Path))]
    if len(set(given)) < len(given):
        raise Failure("Every log must be given once: a log that counts twice agrees with itself. Leave out the second.")
    if any(seed >= MAX_SEED for seed in seeds):
        raise Failure(f"A seed must be below {MAX_SEED:.0e}, but one is {max(seeds)}.")
    named = zip(listed, names_of(logs), strict=True)
    measured = [
        one if isinstance(one.log, (str, Path)) else
        one._replace(log=load_log(one.log, model.columns, model.table, name=name))
        for one, name in named
    ]  # fmt: skip
    return [*measured, *(Listed(int(seed)) for seed in seeds)]


def _time_constants(tau: Sequence[float] | Literal["auto"] | None) -> tuple[float, ...] | Literal["auto"] | None:
    return tau if tau is None or tau == "auto" else tuple(map(float, tau))


def check_setting(setting: CampaignSetting, then: str | None) -> CampaignSetting | None:
    """The further analysis, if there is one; raises Failure for an unknown analysis, method or time constants."""
    for what, name, known in (
        ("question", setting.do, list(LOG_ANALYSES)),
        ("method", setting.method, list(METHOD_NAMES)),
        ("further question", then, list(FURTHER_ANALYSES)),
    ):
        if name is not None and name not in known:
            raise Failure(f"No {what} named '{name}'. Known {what}s: {', '.join(known)}.{did_you_mean(name, known)}")
    check_tau(setting.method, setting.tau)
    if then is not None and setting.do != "identify":
        raise Failure(f"--then follows identify, which tells who stands out, but --do is {setting.do}. Leave it out.")
    return None if then is None else setting._replace(do=then, method="filter_error", tau=None)


def compile_and_try_first(
    model: Model, setting: CampaignSetting, sources: Sequence[Listed], progress: Progress
) -> None:
    """Compile once what every process will want; raises Failure where nothing can be simulated."""
    modules = precompile.module_loaders(model)
    if setting.do in ("identify", "compare"):
        modules = {name: load for name, load in modules.items() if name in precompile.FIT_MODULES}
    precompile.compile_modules(modules, progress)
    if setting.played is not None:
        progress("simulating the first log")
        with suppress(OutOfRange):  # it may stand with other seeds
            simulate_log(model, setting.played, next(s.log for s in sources if isinstance(s.log, int)))


def analyse_logs(
    model: Model,
    setting: CampaignSetting,
    sources: Sequence[Listed],
    known: ResultSet,
    progress: Progress,
    scheduler: str | None = None,
) -> Sequence[LogResult]:
    """Results of all logs, in their order; those that are not known are computed."""
    known.look_at(sources, progress)
    left = {k: source.log for k, source in enumerate(sources) if not known.knows(source)}
    if left:
        compile_and_try_first(model, setting, sources, progress)
    before = len(sources) - len(left)
    with known.held(bool(left)), closing(analyses_as_completed(setting, left, scheduler, progress)) as completed:
        progress(f"{before} of {len(sources)} logs")
        timer = StepTimer(len(left))
        for finished, (k, result) in enumerate(completed, 1):
            known.add(sources[k], result)
            progress(f"{before + finished} of {len(sources)} logs{timer.left_text(finished)}")
        return known.results(sources)
