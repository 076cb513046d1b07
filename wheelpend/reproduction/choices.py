"""Choices that the paper leaves open, ours, and the change of each table with another choice.

Every factor is computed: the numbers with the other choice divided by those with ours. None is chosen for its result.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wheelpend.paper import numbers
from wheelpend.reproduction.estimators import NOMINAL_FACTOR, filtered
from wheelpend.reproduction.experiment import COMMAND_NAMES, Robot, Setup, play
from wheelpend.reproduction.tables import PITCH_DEVIATION_RAD, prediction_errors, table3_errors
from wheelpend.reproduction.trials import PREDICTION_SETUP, Trial

SHORT_DURATION_S, LONG_DURATION_S = 10.0, 30.0  # s
VARIANT_SEED_COUNT = 20  # for the choices that need experiments of their own
NOMINAL_ABOVE_SEED_COUNT = 4  # for the other start of multiple shooting
COMPARED_PARAMETER_INDICES = (0, 1, 2, 3, 4)  # X1 to X5; X6 and X7 are nearly exact in every method
SETUP_VARIANTS = {
    f"{SHORT_DURATION_S:g} s": lambda c: Setup(c, duration=SHORT_DURATION_S),
    f"{LONG_DURATION_S:g} s": lambda c: Setup(c, duration=LONG_DURATION_S),
    "−measured rate": lambda c: Setup(c, rate_error=False),
}


@dataclass(frozen=True)
class ChoiceEffect:
    """Range of the factors by which the numbers of a table change with another choice."""

    table: str
    of: str  # case, command or output
    alternative: str
    smallest: float
    largest: float

    def to_json(self) -> dict[str, Any]:
        """The effect under the keys of JSON and the columns of CSV."""
        return {
            "table": self.table,
            "of": self.of,
            "alternative": self.alternative,
            "smallest": self.smallest,
            "largest": self.largest,
        }


@dataclass(frozen=True)
class Choice:
    """Something that the paper leaves open."""

    name: str
    open: str  # statement of the paper, or its absence
    made: str  # our choice
    effects: tuple[ChoiceEffect, ...]

    def to_json(self) -> dict[str, Any]:
        """The choice under the keys of JSON."""
        return {"name": self.name, "open": self.open, "made": self.made, "effects": self.effects}


def choice_effects(
    table: str, alternative: str, ours: Mapping[str, np.ndarray], other: Mapping[str, np.ndarray]
) -> Iterator[ChoiceEffect]:
    """Effects of an alternative, from absolute numbers with our choice and with the other."""
    for key, base in ours.items():
        if key in other:
            ratio = np.abs(other[key]) / np.abs(base)
            yield ChoiceEffect(table, key, alternative, float(np.min(ratio)), float(np.max(ratio)))


# ---- effects on each table


def table3_effects(robot: Robot) -> dict[str, tuple[ChoiceEffect, ...]]:
    """Effects on Table 3 (FOH), by choice."""
    base = play(robot, Setup())
    ours = _compared_parameters(table3_errors(robot, base))
    tilted = play(robot, Setup(tilt=PITCH_DEVIATION_RAD))

    def changed(alternative: str, other: Mapping[str, np.ndarray]) -> tuple[ChoiceEffect, ...]:
        return tuple(choice_effects("Table 3", alternative, ours, _compared_parameters(other)))

    def played(alternative: str) -> tuple[ChoiceEffect, ...]:
        return changed(alternative, table3_errors(robot, play(robot, SETUP_VARIANTS[alternative]("aggressive"))))

    free = {
        case: np.array(robot.percent_error(filtered(robot, base.log, fit_start=True, tau=(tau, tau))))
        for case, (tau, off, _) in numbers.TABLE_3.items() if off
    }  # fmt: skip
    off = {k: v for k, v in table3_errors(robot, tilted, deviation=0.0).items() if numbers.TABLE_3[k][1]}
    negative = {k: v for k, v in table3_errors(robot, base, deviation=-PITCH_DEVIATION_RAD).items() if k in off}
    return {
        "duration": (*played(f"{SHORT_DURATION_S:g} s"), *played(f"{LONG_DURATION_S:g} s")),
        "rate": played("−measured rate"),
        "hold": changed("ZOH", table3_errors(robot, base, hold="zoh")),
        "start": changed("fitted along", free),
        "deviation": (*changed("−0.5°", negative), *changed("robot tilted, filters not", off)),
        "equal": changed("a hundredth apart", table3_errors(robot, base, tau_ratio=1.01)),
    }


def _compared_parameters(errors: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {case: np.asarray(e)[list(COMPARED_PARAMETER_INDICES)] for case, e in errors.items()}


def tables12_effects(trials: Sequence[Trial], commands: Sequence[str]) -> dict[str, tuple[ChoiceEffect, ...]]:
    """Effects on the filtered method's median errors in Tables 1 and 2 (FOH), and on shooting's, by choice."""
    few = {t.seed for t in trials if t.setup not in [Setup(c) for c in COMMAND_NAMES]}
    above = {t.seed for t in trials if "shooting_above" in t.errors}

    def medians(method: str, seeds: set[int] | None = None, setup: Callable[[str], Setup] = Setup):
        chosen = [t for t in trials if method in t.errors and (seeds is None or t.seed in seeds)]
        rows = {c: [t.errors[method] for t in chosen if t.setup == setup(c)] for c in commands}
        return _compared_parameters({c: np.median(np.abs(r), axis=0) for c, r in rows.items() if r})

    def changed(
        alternative: str, ours: Mapping[str, np.ndarray], other: Mapping[str, np.ndarray], of: str = "filtered"
    ) -> tuple[ChoiceEffect, ...]:
        return tuple(choice_effects(f"Tables 1, 2 ({of})", alternative, ours, other))

    base, some = medians("filtered_foh"), medians("filtered_foh", few)
    varied = {k: changed(k, some, medians("filtered_foh", few, setup)) for k, setup in SETUP_VARIANTS.items()}
    return {
        "duration": (*varied[f"{SHORT_DURATION_S:g} s"], *varied[f"{LONG_DURATION_S:g} s"]),
        "rate": varied["−measured rate"],
        "hold": changed("ZOH", base, medians("filtered_zoh")),
        "start": (*changed("all zero", base, medians("filtered_rest")),
                  *changed("first sample, wheel at rest", base, medians("filtered_still")),
                  *changed("fitted along", base, medians("filtered_free"))),
        "nominal": changed(
            f"{2 - NOMINAL_FACTOR:g} times the truth", medians("shooting", above), medians("shooting_above"), "shooting"
        ),
        "seeds": changed(f"the first {len(few)} seeds", base, some) if len(few) < len({t.seed for t in trials}) else (),
    }  # fmt: skip


def figure_effects(robot: Robot) -> dict[str, tuple[ChoiceEffect, ...]]:
    """Effects on the prediction errors of Figure 5 with the paper's printed estimates, by choice."""
    ours = prediction_errors(robot, PREDICTION_SETUP)

    def played(alternative: str, setup: Setup) -> tuple[ChoiceEffect, ...]:
        return tuple(choice_effects("Figure 5", alternative, ours, prediction_errors(robot, setup)))

    printed = {c: np.array([v[k] for v in numbers.PREDICTION_RMSE.values()]) for k, c in enumerate(COMMAND_NAMES)}
    against = [
        effect
        for command in COMMAND_NAMES
        for effect in choice_effects(f"Figure 5 against the printed RMSE, {command} command", "", printed,
                              prediction_errors(robot, replace(PREDICTION_SETUP, command=command)))
    ]  # fmt: skip
    return {
        "duration": tuple(
            e
            for k in (f"{SHORT_DURATION_S:g} s", f"{LONG_DURATION_S:g} s")
            for e in played(k, SETUP_VARIANTS[k]("aggressive"))
        ),
        "rate": played("−measured rate", SETUP_VARIANTS["−measured rate"]("aggressive")),
        "predicted": tuple(against),
    }


# ---- the list


OPEN_CHOICES = (
    ("duration", "Length of the experiments", "Not given.", "20 s."),
    ("seeds", "Noise", "One draw, its seed not given.", "{seeds} seeds: median, and range from 10 to 90 %."),
    ("rate", "D-term of the controller",
     "Gains for P, I and D; not whether the D-term sees the error's rate or the measured rate.",
     "The error's rate: reference rate − measured rate."),
    ("start", "Initial conditions (42) of the filters",
     "All four states zero. With noise the first reading is not, and the filters need one.",
     "Tables 1 and 2: the first sample, with the wheel's speed from the first two angles. Table 3: zero, with the "
     "stated deviation."),
    ("hold", "Signals between samples", "Zero-order hold.",
     "Both are shown: every signal held (ZOH), or angles and rates linear and only the voltage held (FOH). The factors "
     "are those of ZOH against FOH."),
    ("deviation", "Meaning of the +0.5° deviation",
     "The initial pitch is biased by +0.5°; not whether the filters are wrong or the robot starts tilted.",
     "The robot starts upright and only the filters' initial pitch is +0.5°."),
    ("equal", "Equal time constants in Table 3", "τ1 = τ2, where the partial fractions of (38) have a double pole.",
     "The second time constant is a thousandth larger."),
    ("predicted", "Closed loop of Figures 4 to 6", "The command that the predictions follow is not given.",
     "The aggressive command, with ideal sensors."),
    ("nominal", "Nominal parameters", "Around 90 % of the exact ones, for the design of the controller.",
     "0.9 times each of X1 to X7, where instrumental variables and multiple shooting start."),
)  # fmt: skip


def collect_choices(seeds: int, parts: Sequence[Mapping[str, tuple[ChoiceEffect, ...]]]) -> tuple[Choice, ...]:
    """The choices that matter to the tables that were made, with their effects."""
    found = []
    for key, name, open_, made in OPEN_CHOICES:
        effects = tuple(e for part in parts for e in part.get(key, ()))
        if effects:
            found.append(Choice(name, open_, made.format(seeds=seeds), effects))
    return tuple(found)
