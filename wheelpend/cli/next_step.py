"""What to do after a command, as the command line that does it, on standard error."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from wheelpend.cli.options import DEFAULT_MODEL_PATH, MAX_EFFECTS
from wheelpend.reports.console import print_command_hint

if TYPE_CHECKING:
    from wheelpend.campaigns.runner import Campaign
    from wheelpend.diagnosis.explain import Ladder
    from wheelpend.diagnosis.verdict import Diagnosis

HOLDOUT_WORDS = " (--holdout LOG judges that on another log, else the last third does)"
NEARLY_NOISE = 1.05  # error over the noise floor up to which a model may well lack nothing


class Asked(NamedTuple):
    """Files that a command was given, which the next one takes too."""

    logs: Sequence[Path | str]  # paths, and addresses
    holdout: Sequence[Path] = ()
    model: Path = DEFAULT_MODEL_PATH
    plant: Path | None = None
    json: str | None = None

    def say_next(self, why: str, command: str, *words: str) -> None:
        """Say the next command on these files; nothing where a program reads the result."""
        if self.json != "-":
            print_command_hint(f"Next, {why}:", self.line(command, *words))

    @property
    def without_files(self) -> Asked:
        """The same model, and no logs."""
        return self._replace(logs=(), holdout=())

    def line(self, command: str, *words: str) -> str:
        """A command line on these files."""
        parts = ["wheelpend", command, *words, *map(str, self.logs)]
        parts += [part for log in self.holdout for part in ("--holdout", str(log))]
        parts += ["--model", str(self.model)] * (self.model != DEFAULT_MODEL_PATH)
        parts += ["--plant", str(self.plant)] * (self.plant is not None)
        return shlex.join(parts)


def say_after_identification(asked: Asked, something_is_missing: bool) -> None:
    """What to do with fitted values, and where ``something_is_missing`` first, without which they mean little."""
    if something_is_missing:
        asked.say_next("which physical effect is missing", "diagnose")
    else:
        asked.say_next("how well the model predicts, and where it fails", "compare")


def say_after_comparison(asked: Asked, error: float | None, noise_floor: float | None) -> None:
    """What to do where a model has been compared with measurements."""
    if error is not None and noise_floor is not None and error <= NEARLY_NOISE * noise_floor:
        asked.say_next("whether anything is left that the noise does not explain", "diagnose")
    else:
        alone = len(asked.logs) == 1 and not asked.holdout
        asked.say_next(f"which physical effect is missing{HOLDOUT_WORDS if alone else ''}", "diagnose")


def question_words(without: Sequence[str], law: bool, max_effects: int = MAX_EFFECTS) -> list[str]:
    """The options of `diagnose`, `explain` and `report` that ask the same question again."""
    words = [part for name in without for part in ("--without", name)] + ["--law"] * law
    return words + ["--max-effects", str(max_effects)] * (max_effects != MAX_EFFECTS)


def say_after_diagnosis(asked: Asked, found: Diagnosis, without: Sequence[str], law: bool) -> None:
    """What to do with the verdict on a library ``without`` some effects, after which a ``law`` was sought or not."""
    if found.verdict in ("effect_missing", "ambiguous"):
        effect = found.candidates[0].effect
        others = list(found.candidates[0].equivalent_to)
        if found.verdict == "ambiguous" and others and found.problem.plant.is_balanced:
            asked._replace(holdout=()).say_next(
                "a command that tells them apart", "design", "--between", f"{effect},{others[0]}"
            )
        asked.say_next("add it and watch the error fall", "add", effect)
    elif found.verdict == "unexplained" and found.steps and not law:
        asked.say_next("add what explains a part of it, step by step", "explain", *question_words(without, law))
    elif found.verdict == "unexplained" and (law or found.determines_nothing):
        asked.say_next("all of it on one page", "report", *question_words(without, law))
    elif found.verdict == "unexplained":
        asked.say_next("what law the rest follows, a minute longer", "diagnose", *question_words(without, law=True))
    else:
        asked._replace(holdout=()).say_next("keep the fitted values", "identify", "--save")


def say_after_report(asked: Asked, found: Ladder, question: Sequence[str], saved: bool) -> None:
    """What to do with what a page tells: keep it, seek a law for what no effect explains, or ask what would decide."""
    ambiguous = [s for s in found.steps if s.equivalent_to]
    if found.steps and not saved:
        asked.say_next("the same once more, and keep it", "explain", *question, "--save")
    elif found.verdict == "unexplained" and "--law" not in question:
        asked.say_next("the same with a law for the rest, a minute longer", "report", *question, "--law")
    if ambiguous and found.model.plant_signature.is_balanced:
        pair = f"{ambiguous[0].effect},{ambiguous[0].equivalent_to[0]}"
        asked._replace(holdout=()).say_next("a command that tells them apart", "design", "--between", pair)
    elif not found.steps and found.verdict == "nothing_missing":
        asked._replace(holdout=()).say_next("keep the fitted values", "identify", "--save")


def say_after_campaign(asked: Asked, found: Campaign) -> None:
    """What to do with many logs: look at the one that is off, ask what all lack, or add what most of them name."""
    from wheelpend.campaigns.addresses import is_address  # imported late: loads NumPy, as this does
    from wheelpend.campaigns.summary import ParameterAgreement

    summary = found.summary
    if found.simulated:
        return
    agreements = [summary.parameters[name] for name in summary.disagreeing]
    off = [p.furthest.log for p in agreements if isinstance(p, ParameterAgreement) and p.furthest]
    local = [log for log in asked.logs if not is_address(log)]
    if odd := [log for log in local if off and off[0] in (str(log), Path(log).name)]:
        asked._replace(logs=odd).say_next("what is odd about the log that is furthest off", "inspect")
    if found.do in ("identify", "compare"):
        asked.say_next(
            "which physical effect each of them lacks", "campaign", "--do", "diagnose", "--out", "missing.csv"
        )
    elif summary.named:
        asked.say_next("add what most of them lack", "add", next(iter(summary.named)))


__all__ = [
    "Asked",
    "question_words",
    "say_after_campaign",
    "say_after_comparison",
    "say_after_diagnosis",
    "say_after_identification",
    "say_after_report",
]
