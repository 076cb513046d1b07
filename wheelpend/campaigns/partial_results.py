"""Results of an unfinished campaign: which of its logs are done, and what belongs to the same question."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import derive
import wheelpend
from wheelpend.campaigns.journal import Journal, fingerprint_of, with_tuples
from wheelpend.campaigns.one_log import CampaignSetting, ErrorCovariance, Estimate, LogResult, LogSource, NamedEffect
from wheelpend.kernels.cache import derivation_fingerprint
from wheelpend.logs.log import Log
from wheelpend.model.record import Model
from wheelpend.serialise import plain_data


class PartialResults:
    """The journal of a campaign, by log.

    Results of another setting, of other code or of a log that has changed since are not used. Nor are failures, whose
    cause may be gone by now.
    """

    def __init__(self, path: Path | None, setting: CampaignSetting, model: Model) -> None:
        self.journal = Journal(path, fingerprint(setting, model))

    def known(self, source: LogSource) -> LogResult | None:
        """The result of a log that was analysed before, or None."""
        key = source_key(source)
        found = self.journal.results.get(key) if key is not None else None
        return result_from_json(found) if found else None

    def begin(self) -> Path | None:
        """Write what is known; returns where a journal of another setting went, raises Failure where that fails."""
        return self.journal.begin()

    def add(self, source: LogSource, result: LogResult) -> None:
        """Write one more result, unless it is a failure or its log is in no file."""
        key = source_key(source)
        if key is not None and result.failure is None:
            self.journal.add(key, plain_data(result))


def source_key(source: LogSource) -> str | None:
    """A log's seed, or its file with size and time; None for one that is in no file."""
    if isinstance(source, Log):
        return None
    if isinstance(source, int):
        return str(source)
    try:
        found = os.stat(source)
    except OSError:
        return None
    return f"{source} {found.st_size} {found.st_mtime_ns}"


def result_from_json(data: Mapping[str, Any]) -> LogResult:
    """A result from JSON."""
    fields = {name: with_tuples(value) for name, value in data.items()}
    fields["parameters"] = {name: Estimate(**row) for name, row in data["parameters"].items()}
    if data["covariance"] is not None:
        fields["covariance"] = ErrorCovariance(**{k: with_tuples(v) for k, v in data["covariance"].items()})
    fields["conditions"] = dict(data["conditions"])
    fields["named"] = tuple(NamedEffect(n["effect"], tuple(n["equivalent_to"])) for n in data["named"])
    return LogResult(**fields)


def fingerprint(setting: CampaignSetting, model: Model) -> str:
    """Hash of everything besides a log that decides its result: the model, the question, and the code."""
    own = sorted(repr(derive.effects.USER_EFFECTS[n]) for n in model.own)
    question = repr((setting, own, derive.plants.fingerprint(model.plant)))
    command = Path(setting.played.command) if setting.played else Path()
    files = (command, *sorted(Path(wheelpend.__file__).parent.rglob("*.py")))
    return fingerprint_of((question, derivation_fingerprint()), filter(Path.is_file, files))[:16]
