"""What to do next, from what is there: the way of working, a click at a time."""

from __future__ import annotations

from typing import NamedTuple

from wheelpend.view.bench import Bench

ASKED_AFTERWARDS = (
    "equations",
    "compare",
    "predictions",
    "diagnose",
    "figures",
)  # what is shown anew once the model has changed
CLICK_NUMBERS = {"compare": "Click 1 of 3", "learn": "Click 2 of 3", "add": "Click 3 of 3"}


class NextStep(NamedTuple):
    """The panel where the work goes on, what to press there, and why."""

    panel: str  # its name
    sentence: str
    effect: str = ""  # that is to be added


def next_step(bench: Bench) -> NextStep:
    """Where the work goes on."""
    if not bench.logs:
        return NextStep("open", "Open a log: drop its file into the first panel, or name it there.")
    if bench.model() is None:
        return NextStep("open", "Start a workspace: the first panel makes one as the log suggests.")
    if bench.current("compare") is None and bench.current("diagnose") is None:
        return NextStep("compare", "press Compare, to see how well the model predicts the log.")
    found = bench.current("diagnose")
    if found is None:
        return NextStep("learn", "press Learn what is missing: every effect is tried, and judged on data no fit sees.")
    return _after_diagnosis(found.result)


def _after_diagnosis(result: dict) -> NextStep:
    verdict, candidates = result.get("verdict"), result.get("candidates") or [{}]
    effect = candidates[0].get("effect", "")
    if verdict in ("effect_missing", "ambiguous") and effect:
        return NextStep("add", f"press Add {effect}, and watch the error fall.", effect)
    if verdict == "unexplained" and (steps := result.get("steps")):
        others = f", then {' and '.join(steps[1:])}" if steps[1:] else ""
        return NextStep("add", f"press Add {steps[0]}, which explains a part of what is missing{others}.", steps[0])
    if verdict == "nothing_missing" and (instead := (result.get("remainder") or {}).get("instead")):
        laws = " or ".join(instead)
        sentence = f"what remains may be chance or {laws}: press Add {instead[0]} to see what it leaves, or go on."
        return NextStep("add", sentence, instead[0])
    if verdict == "nothing_missing":
        return NextStep("go_on", "Nothing more is missing. Keep the values, write the report, or export the model.")
    return NextStep(
        "go_on", "Something is missing that no effect explains: a law may be fitted, or a new log designed."
    )


def hint_text(bench: Bench) -> str:
    """The next step in words; on a first run with the number of its click."""
    step = next_step(bench)
    number = CLICK_NUMBERS.get(step.panel, "") if bench.first_run else ""
    label = number or ("Next" if step.panel in CLICK_NUMBERS else "")
    return f"{label}: {step.sentence}" if label else step.sentence


def chain(bench: Bench, *first: tuple[str, ...]) -> list[tuple[str, ...]]:
    """Commands that change the model, and then those that look at it anew."""
    return [*first, *((name, *_files_of(bench, name)) for name in ASKED_AFTERWARDS)]


def _files_of(bench: Bench, command: str) -> tuple[str, ...]:
    return bench.model_words if command == "equations" else bench.files
