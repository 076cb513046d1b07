"""The public `diagnose` and `explain`: the search of `diagnosis`, with advice on what stays open."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from wheelpend.diagnosis.criteria import MAX_ADDED_EFFECTS
from wheelpend.diagnosis.explain import Ladder
from wheelpend.diagnosis.explain import explain as error_ladder
from wheelpend.diagnosis.stepwise import diagnose as diagnose_stepwise
from wheelpend.diagnosis.verdict import Diagnosis
from wheelpend.experiments.advice import with_advice
from wheelpend.logs.sources import LogsLike
from wheelpend.model.record import Model


def diagnose(
    model: Model,
    logs: LogsLike,
    holdout: LogsLike = (),
    *,
    without: Sequence[str] = (),
    law: bool = False,
    progress: Callable[[str], None] = lambda text: None,
) -> Diagnosis:
    """Find which effect of the library is missing, those named in ``without`` apart. Changes nothing.

    ``logs`` and ``holdout`` are one or several, each a path, a Log, a DataFrame or a dict of arrays (N,), as of
    ``load_log``. With ``law`` a free-form law is fitted to what no effect explains; that takes about a minute.
    Raises Failure where the logs or the model cannot be used.
    """
    return with_advice(diagnose_stepwise(model, logs, holdout, without=without, law=law, progress=progress))


def explain(
    model: Model,
    logs: LogsLike,
    holdout: LogsLike = (),
    *,
    max_effects: int = MAX_ADDED_EFFECTS,
    without: Sequence[str] = (),
    law: bool = False,
    progress: Callable[[str], None] = lambda text: None,
) -> Ladder:
    """Add effects, the best first, until nothing is missing or max_effects were added. Writes no files.

    ``logs`` and ``holdout`` are those of ``diagnose``. Effects named in ``without`` are not tried. With ``law`` a
    free-form law is fitted to what no effect explains.
    Raises Failure where the logs or the model cannot be used.
    """
    found = error_ladder(model, logs, holdout, max_effects=max_effects, without=without, law=law, progress=progress)
    first, last = with_advice(found.first), with_advice(found.last)
    between = with_advice(found.unclear).experiment if found.unclear and not first.experiment else None
    return replace(found, first=first, last=last, experiment=first.experiment or between or last.experiment)
