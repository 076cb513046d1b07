"""All logs of a campaign, on all cores."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from concurrent.futures import BrokenExecutor
from contextlib import closing, suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from time import monotonic
from typing import Literal

from wheelpend.campaigns.journal import PartialResults
from wheelpend.campaigns.one_log import (
    LOG_ANALYSES,
    CampaignSetting,
    LogResult,
    LogSource,
    SimulationSpec,
    analyse_log,
    simulate_log,
)
from wheelpend.campaigns.summary import Summary, summarise
from wheelpend.errors import Failure, OutOfRange, did_you_mean
from wheelpend.identification.method_options import METHOD_NAMES, check_tau
from wheelpend.logs.log import Log
from wheelpend.model import precompile
from wheelpend.model.record import Model
from wheelpend.model.user_plants import plant_file
from wheelpend.parallel import results_as_completed
from wheelpend.simulation.hidden import with_full_parameter_names

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Campaign:
    """What many logs answer to one question."""

    do: str
    method: str | None  # of identify
    simulated: SimulationSpec | None
    logs: tuple[LogResult, ...]
    summary: Summary
    model: Model = field(repr=False)


def campaign(
    model: Model,
    logs: Sequence[str | Path | Log] = (),
    *,
    seeds: Collection[int] = (),
    command: str = "aggressive",
    duration: float | None = None,
    hide: Mapping[str, float] | None = None,
    do: str = "identify",
    method: str = "shooting",
    tau: Sequence[float] | Literal["auto"] | None = None,
    keep: Path | None = None,
    progress: Progress = lambda text: None,
) -> Campaign:
    """Identify, compare, diagnose or explain every log by itself, measured ones or one simulated with each seed.

    ``command``, ``duration`` [s] and ``hide`` are those of ``simulate``, ``method`` and ``tau`` [s] those of
    ``identify``. A log that cannot be used has a failure in its answer, and the others go on. ``keep`` is a file for
    the answers as they come, from which an interrupted campaign of the same setting goes on. On several cores the logs
    are asked in processes of their own, so a script that calls this needs the usual ``if __name__ == "__main__":``.
    Raises Failure for a question that no log could answer.
    """
    simulated = SimulationSpec(command, duration, with_full_parameter_names(hide or {})) if seeds else None
    sources = check_sources(logs, seeds)
    setting = CampaignSetting(
        model.text, model.path, plant_file(model.plant), do, method, _time_constants(tau), simulated
    )
    check_setting(setting)
    kept = PartialResults(keep, setting, model)
    before = {k: known for k, source in enumerate(sources) if (known := kept.known(source))}
    left = {k: source for k, source in enumerate(sources) if k not in before}
    if left:
        compile_and_try_first(model, setting, sources, progress)
        if aside := kept.begin():
            progress(f"{aside.stem} holds answers to another question, or of earlier code: put aside as {aside.name}")
    found = analyse_logs(setting, left, before, kept, progress)
    answers = tuple(found[k] for k in range(len(sources)))
    identified = method if do == "identify" else None
    return Campaign(do, identified, simulated, answers, summarise(model, simulated, answers), model)


def check_sources(logs: Sequence[str | Path | Log], seeds: Collection[int]) -> list[LogSource]:
    """The logs that are asked; raises Failure unless they are of one kind, and each there once."""
    if bool(logs) == bool(seeds):
        raise Failure("A campaign must have measured logs or the seeds of simulated ones, not "
                      f"{'both' if logs else 'neither'}.")  # fmt: skip
    files = {str(Path(p).resolve()) for p in logs if not isinstance(p, Log)}
    if len(files) < sum(not isinstance(p, Log) for p in logs):
        raise Failure("Every log must be given once: a log that counts twice agrees with itself. Leave out the second.")
    return [*logs, *map(int, seeds)]


def _time_constants(tau: Sequence[float] | Literal["auto"] | None) -> tuple[float, ...] | Literal["auto"] | None:
    return tau if tau is None or tau == "auto" else tuple(map(float, tau))


def check_setting(setting: CampaignSetting) -> None:
    """Raise Failure for a question that no log could answer."""
    for what, name, known in (
        ("question", setting.do, list(LOG_ANALYSES)),
        ("method", setting.method, list(METHOD_NAMES)),
    ):
        if name not in known:
            raise Failure(f"No {what} named '{name}'. Known {what}s: {', '.join(known)}.{did_you_mean(name, known)}")
    check_tau(setting.method, setting.tau)


def compile_and_try_first(
    model: Model, setting: CampaignSetting, sources: Sequence[LogSource], progress: Progress
) -> None:
    """Compile once what every process will want, and see that there is something to simulate."""
    modules = precompile.module_loaders(model)
    if setting.do in ("identify", "compare"):
        modules = {name: load for name, load in modules.items() if name in ("library", "model")}
    precompile.compile_modules(modules, progress)
    if setting.played is not None:
        progress("simulating the first log")
        with suppress(OutOfRange):  # it may stand with other seeds
            simulate_log(model, setting.played, next(s for s in sources if isinstance(s, int)))


def analyse_logs(
    setting: CampaignSetting,
    asked: Mapping[int, LogSource],
    before: Mapping[int, LogResult],
    kept: PartialResults,
    progress: Progress,
) -> dict[int, LogResult]:
    """Answers of logs by number, those from before included, on all cores; every answer is kept as it comes."""
    found, begin, whole = dict(before), monotonic(), len(before) + len(asked)
    places, jobs = list(asked), [partial(analyse_log, setting, source) for source in asked.values()]
    progress(f"{len(found)} of {whole} logs")
    try:
        with closing(results_as_completed(jobs)) as ended:
            for place, told in ended:
                number = places[place]
                found[number] = told
                kept.add(asked[number], told)
                each = (monotonic() - begin) / (len(found) - len(before))
                progress(f"{len(found)} of {whole} logs, about {duration_text(each * (whole - len(found)))} left")
    except BrokenExecutor:
        raise Failure("The processes of a campaign must live to its end, but one was ended from outside; was there too "
                      "little memory? The same command goes on from what came so far.") from None  # fmt: skip
    return found


def duration_text(seconds: float) -> str:
    """A time as one would say it."""
    return f"{seconds:.0f} s" if seconds < 100 else f"{seconds / 60:.0f} min"
