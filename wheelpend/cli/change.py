"""The commands add and remove, and what --save records."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path

import derive
from wheelpend.diagnosis.change import Change, add
from wheelpend.diagnosis.explain import Ladder
from wheelpend.errors import Failure
from wheelpend.estimation.problem import extended_effects, require_testable
from wheelpend.model import workspace
from wheelpend.model.record import Model
from wheelpend.model.workspace import HistoryEntry
from wheelpend.reports.console import exit_on_failure, print_line, print_result, print_text, print_warnings, progress
from wheelpend.reports.numbers import digits_text
from wheelpend.reports.text.effect_sizes import effect_size_text, log_size_lines
from wheelpend.reports.text.remainder import remainder_sentences

SAVED_SENTENCE = "Saved {} and regenerated its kernels."


def change(
    effect: str,
    data: Sequence[Path],
    holdout: Sequence[Path],
    to_change: AbstractContextManager[Model],
    json: str | None,
    *,
    remove: bool,
) -> None:
    """Add or remove an effect, refit where data are given, save the workspace and show what it did."""
    with exit_on_failure(json), to_change as opened:
        model = checked_model(opened, effect, remove)
        if not data:
            if holdout:
                raise Failure("--holdout judges a refit, so it needs a LOG to refit on as well.")
            change_without_refit(model, effect, json, remove=remove)
            return
        with progress("reading") as update:
            changed = add(model, effect, data, holdout, remove=remove, progress=update)
            workspace.save(
                changed.model,
                [history_entry(effect, remove, changed, recorded(model, (*data, *holdout)))],
                opened=model,
            )
        print_warnings(changed.warnings)
        print_result(changed, json, lambda: print_change(changed, effect, remove))


def change_without_refit(model: Model, effect: str, json: str | None, *, remove: bool) -> None:
    """Add or remove an effect and save the workspace with the parameter values as they are."""
    effects = [e for e in model.effects if e != effect] if remove else extended_effects(model, effect)
    workspace.save(model.with_effects(effects), [history_entry(effect, remove, None, ())], opened=model)
    result = {"schema": 1, "effect": effect, "effects": effects, "error_before": None, "error_after": None}
    sentence = (
        f"{'Removed' if remove else 'Added'} {effect}; nothing was refitted. "
        "Name a LOG to refit and see what it does to the error."
    )
    print_result(result, json, lambda: print_line(sentence))


def checked_model(model: Model, effect: str, remove: bool) -> Model:
    """The model; raises Failure unless the effect can be added to it or removed from it."""
    try:
        row = derive.effects.find(effect)
    except KeyError as error:
        raise Failure(error.args[0]) from None
    if remove and effect not in model.effects:
        raise Failure(
            f"{effect} must be in the model to be removed; the model has {', '.join(model.effects) or 'none'}."
        )
    if not remove and effect in model.effects:
        raise Failure(f"{effect} is in the model already. `wheelpend identify LOG --save` refits it.")
    if not remove:
        require_testable(row, model)
    return model


def recorded(model: Model, logs: Sequence[Path]) -> tuple[Path, ...]:
    """Paths of logs for the workspace's history: as typed in the workspace, from elsewhere whole."""
    return tuple(logs if Path.cwd().samefile(model.workspace) else map(Path.absolute, logs))


def history_entry(effect: str, remove: bool, changed: Change | None, logs: Sequence[Path]) -> HistoryEntry:
    """A line of the workspace's history, with the logs that it was fitted to and judged on."""
    step = changed.step if changed else None
    return HistoryEntry(
        change=f"{'remove' if remove else 'add'} {effect}",
        error_before=step.error_before if step else None,
        error_after=step.error_after if step else None,
        logs=tuple(map(str, logs)),
        parameters=changed.model.estimates() if changed else {},
    )


def print_change(changed: Change, effect: str, remove: bool) -> None:
    """Print what the change did to the error, and the size of an added effect."""
    step = changed.step
    before, after, floor = map(digits_text, (step.error_before, step.error_after, changed.problem.floor))
    verb = "Removed" if remove else "Added"
    print_line(f"{verb} {effect}: held-out error {before} → {after} (noise floor {floor}).")
    if not remove:
        print_line(f"{effect}: {effect_size_text(step, changed.model)}.")
        print_text(log_size_lines(step))
    print_text(remainder_sentences(changed.remainder, changed.model))
    print_line(SAVED_SENTENCE.format(changed.model.path))


def save_explanation(result: Ladder, logs: Sequence[Path], holdout: Sequence[Path], opened: Model) -> str:
    """Save an explanation's model, where it still is as opened, with its steps in the history; says what was saved."""
    model = result.model
    names = tuple(map(str, recorded(opened, (*logs, *holdout))))
    entries = [HistoryEntry(f"add {s.effect}", s.error_before, s.error_after, names) for s in result.steps]
    if entries:
        entries[-1] = entries[-1]._replace(parameters=model.estimates())
    workspace.save(model, entries, opened=opened)
    return SAVED_SENTENCE.format(model.path)
