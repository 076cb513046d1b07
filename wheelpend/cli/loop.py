"""Commands of the loop: identify, residuals, compare, diagnose, add, remove, explain, report."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from wheelpend.cli.app import app
from wheelpend.cli.next_step import (
    Asked,
    question_words,
    say_after_comparison,
    say_after_diagnosis,
    say_after_identification,
    say_after_report,
)
from wheelpend.cli.options import (
    DEFAULT_MODEL_PATH,
    MAX_EFFECTS,
    Accept,
    Against,
    Bound,
    Data,
    Fix,
    Forgetting,
    Hold,
    Holdout,
    Json,
    Law,
    Logs,
    MaxEffects,
    Method,
    ModelFile,
    PlantFile,
    RefitLogs,
    SaveExplanation,
    Tau,
    TauMap,
    Without,
    open_model,
    opened_to_change,
    parse_bounds,
    parse_fixed,
    parse_tau,
    print_log_findings,
)
from wheelpend.errors import Failure
from wheelpend.reports.console import exit_on_failure, print_line, print_result, print_text, print_warnings, progress


@app.command()
def demo(out: Annotated[Path, typer.Option(help="Folder for the workspace and the report.")] = Path("demo")) -> None:
    """The whole story on the shipped log: compare, see where it fails, diagnose, add, watch the error fall."""
    from wheelpend.cli.demo import run_demo

    with exit_on_failure():
        run_demo(out)


@app.command()
def identify(
    logs: Logs,
    method: Method = "filter_error",
    tau: Tau = None,
    hold: Hold = None,
    forgetting: Forgetting = None,
    tau_map: TauMap = None,
    fix: Fix = None,
    bound: Bound = None,
    save: Annotated[bool, typer.Option("--save", help="Keep the values in the model file.")] = False,
    model: ModelFile = DEFAULT_MODEL_PATH,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """Identify the parameters, with standard errors."""
    # imported late, as in every command: the list of commands needs neither NumPy nor Numba
    from wheelpend.identification.identify import identify as run
    from wheelpend.identification.remainder_warnings import say_that_something_is_missing
    from wheelpend.model.workspace import save_values
    from wheelpend.reports.text.identification import identification_text

    with exit_on_failure(json, tau_map), opened_to_change(model, plant, save) as opened:
        options: dict[str, Any] = {
            "method": method, "tau": parse_tau(tau, tau_map), "hold": hold, "forgetting": forgetting,
            "fixed": parse_fixed(fix or []), "bounds": parse_bounds(bound or []),
        }  # fmt: skip
        with progress("reading") as update:
            try:
                result = run(opened, logs, progress=update, **options)
            except Failure:
                print_log_findings(logs, opened)  # of which one may be why
                raise
        said = [] if result.is_explained else print_log_findings(logs, opened)
        if save:  # before anything is printed: where that fails, the failure is all that is said
            save_values(opened, result.model)
        print_warnings(result.warnings, said)
        print_result(result, json, lambda: print_text(identification_text(result)))
        if tau_map and result.guide:
            from wheelpend.identification.time_constants import save_error_maps  # imported late: loads Matplotlib

            save_error_maps(result.guide, tau_map)
        lacking = say_that_something_is_missing(result.warnings)
        say_after_identification(Asked(logs, (), model, plant, json), lacking)


def _print_judged(asked: Asked, judge: Callable, text: Callable, **options: Any) -> Any:
    """Say what the logs' faults are, then what a judgement of the model on them finds, its warnings first."""
    opened, logs = open_model(asked.model, asked.plant), list(map(Path, asked.logs))
    said = print_log_findings(logs, opened, list(map(Path, asked.holdout)))
    with progress("reading") as update:
        result = judge(opened, logs, **options, progress=update)
    print_warnings(result.warnings, said)
    print_result(result, asked.json, lambda: print_text(text(result, opened)))
    return result


@app.command()
def residuals(
    logs: Logs,
    model: ModelFile = DEFAULT_MODEL_PATH,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """Residual tests per channel: whiteness, independence of past inputs, σ found against σ assumed."""
    from wheelpend.identification.residual_tests import residuals as run
    from wheelpend.reports.text.residuals import residuals_text

    with exit_on_failure(json):
        asked = Asked(logs, (), model, plant, json)
        _print_judged(asked, run, residuals_text)
        asked.say_next("which physical effect is missing", "diagnose")


@app.command()
def compare(
    logs: Logs,
    holdout: Holdout = None,
    against: Against = None,
    model: ModelFile = DEFAULT_MODEL_PATH,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """Model against measurements: fit per channel, error against horizon, closed loop, and where it fails."""
    from wheelpend.diagnosis.compare import compare as run
    from wheelpend.reports.text.comparison import comparison_text

    with exit_on_failure(json):
        asked = Asked(logs, holdout or (), model, plant, json)
        others = {str(path): open_model(path, plant) for path in against or ()}
        result = _print_judged(asked, run, comparison_text, holdout=asked.holdout, against=others)
        say_after_comparison(asked, result.error, result.noise_floor)


@app.command()
def diagnose(
    logs: Logs,
    holdout: Holdout = None,
    without: Without = None,
    law: Law = False,
    accept: Accept = None,
    model: ModelFile = DEFAULT_MODEL_PATH,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """Which physical effect is missing, ranked, with evidence. Changes nothing, unless a law is accepted."""
    from wheelpend.api import diagnose as run
    from wheelpend.cli.kept_searches import searched
    from wheelpend.diagnosis.missing_force.free_law import accept_law, check_law_name
    from wheelpend.reports.text.diagnosis import diagnosis_text
    from wheelpend.reports.text.unexplained import LawRequest

    with exit_on_failure(json), opened_to_change(model, plant, accept is not None) as opened:
        check_law_name(opened, accept)
        said = print_log_findings(logs, opened, holdout)
        with progress("reading") as update:
            asked = LawRequest(law or accept is not None, accept is not None)
            options = {"without": without or [], "law": asked.law}
            result = searched("diagnosis", run, opened, (logs, holdout or []), options, update)
        print_warnings(result.warnings, said)
        print_result(result, json, lambda: print_text(diagnosis_text(result, opened, asked)))
        files = Asked(logs, holdout or (), model, plant, json)
        if accept is not None:
            print_line(accept_law(opened, result.law, accept))
            files.say_next("add it and watch the error fall", "add", accept)
        else:
            say_after_diagnosis(files, result, without or (), asked.law)


@app.command()
def add(
    effect: Annotated[str, typer.Argument(help="Name of the effect; `wheelpend effects` lists them.")],
    logs: RefitLogs = None,
    data: Data = None,
    holdout: Holdout = None,
    model: ModelFile = DEFAULT_MODEL_PATH,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """Add an effect: re-derive, regenerate, refit, and show the error before and after."""
    from wheelpend.cli.change import change

    named = [*(logs or []), *(data or [])]
    change(effect, named, holdout or [], opened_to_change(model, plant), json, remove=False)
    asked = Asked(named, holdout or (), model, plant, json)
    if named:
        asked.say_next("whether more is missing", "diagnose")
    else:
        asked.say_next("refit", "identify", "LOG", "--save")


@app.command()
def remove(
    effect: Annotated[str, typer.Argument(help="Name of the effect.")],
    logs: RefitLogs = None,
    data: Data = None,
    holdout: Holdout = None,
    model: ModelFile = DEFAULT_MODEL_PATH,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """Remove an effect from the model; the opposite of add."""
    from wheelpend.cli.change import change

    named = [*(logs or []), *(data or [])]
    change(effect, named, holdout or [], opened_to_change(model, plant), json, remove=True)
    Asked((), (), model, plant, json).say_next("every change and what it did", "history")


@app.command()
def explain(
    logs: Logs,
    holdout: Holdout = None,
    max_effects: MaxEffects = MAX_EFFECTS,
    without: Without = None,
    law: Law = False,
    accept: Accept = None,
    save: SaveExplanation = False,
    model: ModelFile = DEFAULT_MODEL_PATH,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """Diagnose and add in turn until nothing is missing; the error ladder."""
    from wheelpend.api import explain as run
    from wheelpend.cli.change import save_explanation
    from wheelpend.cli.kept_searches import searched
    from wheelpend.diagnosis.missing_force.free_law import accept_law, check_law_name
    from wheelpend.reports.text.explanation import explanation_text
    from wheelpend.reports.text.unexplained import LawRequest

    with exit_on_failure(json), opened_to_change(model, plant, save or accept is not None) as opened:
        check_law_name(opened, accept)
        said = print_log_findings(logs, opened, holdout)
        with progress("reading") as update:
            asked, left_out = LawRequest(law or accept is not None, accept is not None), without or []
            options = {"max_effects": max_effects, "without": left_out, "law": asked.law}
            result = searched("ladder", run, opened, (logs, holdout or []), options, update)
        saved = save_explanation(result, logs, holdout or [], opened) if save else ""
        print_warnings(result.warnings, said)
        print_result(result, json, lambda: print_text(explanation_text(result, asked)))
        if saved:
            print_line(saved)
        if accept is not None:
            print_line(accept_law(opened, result.law, accept))
        files = Asked(logs, holdout or (), model, plant, json)
        question = question_words(left_out, asked.law, max_effects)
        if result.steps and not save:
            files.say_next("the same once more, and keep it", "explain", *question, "--save")
        files.say_next("all of it on one page", "report", *question)


@app.command()
def report(
    logs: Logs,
    holdout: Holdout = None,
    output: Annotated[Path, typer.Option("-o", "--out", "--output", help="The page to write.")] = Path("report.html"),
    max_effects: MaxEffects = MAX_EFFECTS,
    without: Without = None,
    law: Law = False,
    save: SaveExplanation = False,
    model: ModelFile = DEFAULT_MODEL_PATH,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """One self-contained HTML page with everything above; the JSON is that of explain."""
    from wheelpend.api import explain as run
    from wheelpend.cli.change import save_explanation
    from wheelpend.cli.kept_searches import searched
    from wheelpend.reports.page.page import write_report
    from wheelpend.version import version

    with exit_on_failure(json, output), opened_to_change(model, plant, save) as opened:
        left_out, asked = without or [], Asked(logs, holdout or (), model, plant, json)
        question = question_words(left_out, law, max_effects)
        command = asked.line("report", *question)
        files = [*logs, *(holdout or [])]
        with progress("reading") as update:
            options = {"max_effects": max_effects, "without": left_out, "law": law}
            result = searched("ladder", run, opened, (logs, holdout or []), options, update)
            update("testing the residuals and writing the page")
            written = write_report(result, output, version=version(), command=command, files=files)
        saved = save_explanation(result, logs, holdout or [], opened) if save else ""  # the page tells what was before
        print_result(result, json, lambda: print_line(f"Wrote {written}."))
        if saved and json != "-":
            print_line(saved)
        say_after_report(asked, result, question, save)
