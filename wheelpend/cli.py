"""The command line."""

from __future__ import annotations

import gc
import os
from pathlib import Path
from typing import Annotated, Literal

import typer

from wheelpend import console
from wheelpend.console import failures, progress, say, show, table, warn, write_text

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Find out what the model of a wheel-driven inverted pendulum is missing.",
)

Logs = Annotated[list[Path], typer.Argument(help="Measurement files, CSV or Parquet.", show_default=False)]
Holdout = Annotated[list[Path] | None, typer.Option("--holdout", help="A log that no fit sees; repeat for several.")]
Without = Annotated[list[str] | None, typer.Option("--without", help="An effect not to try; repeat for several.")]
Law = Annotated[bool, typer.Option("--law", help="Fit a free-form law to what no effect explains; takes a minute.")]
Accept = Annotated[
    str | None, typer.Option("--accept", metavar="NAME", help="Write that law to effects.toml as an effect of yours.")
]
Data = Annotated[list[Path] | None, typer.Option("--data", help="Log to refit on; repeat for several.")]
ModelFile = Annotated[Path, typer.Option("--model", help="The model file, or its folder.")]
Json = Annotated[
    str | None, typer.Option("--json", metavar="FILE", help="Write the result as JSON; '-' is standard output.")
]
PlantFile = Annotated[
    Path | None,
    typer.Option("--plant", metavar="FILE.py", help="A plant of your own: Python code, run because it is named here."),
]
MODEL = Path("model.toml")


def open_model(path: Path, plant: Path | None = None):
    """Open the model named on the command line; its plant may be that of a file of the user's own, named there too."""
    from wheelpend.model import Model

    if plant is not None:
        from wheelpend.own_plants import load_plant

        load_plant(plant)
    return Model.open(path)


@app.command()
def demo(out: Annotated[Path, typer.Option(help="Folder for the workspace and the report.")] = Path("demo")) -> None:
    """The whole story on the shipped log: compare, see where it fails, diagnose, add, watch the error fall."""
    from wheelpend.demo import run

    with failures():
        run(out)


@app.command()
def new(
    folder: Annotated[Path, typer.Argument(help="Where to start the workspace.")] = Path(),
    plant: Annotated[
        str, typer.Option(help="wheel_pendulum, slide, pendulum, cart_pole, or a plant of your own: FILE.py.")
    ] = "wheel_pendulum",
) -> None:
    """Start a workspace with the paper's model, or that of another plant: model.toml and generated/."""
    from wheelpend import workspace
    from wheelpend.own_plants import named_plant

    with failures(), progress("deriving the model"):
        model = workspace.create(folder, named_plant(plant))
        again = f" --plant {plant}" if plant.endswith(".py") else ""
        say(f"Started {model.path} with its generated code. Try `wheelpend simulate -o log.csv{again}` there.")


@app.command()
def equations(
    latex: Annotated[bool, typer.Option("--latex", help="Print LaTeX.")] = False,
    diff: Annotated[
        str | None,
        typer.Option(metavar="OTHER", help="Print what changes: OTHER is a model file, or ASSUMPTION=CHOICE."),
    ] = None,
    model: ModelFile = MODEL,
    plant: PlantFile = None,
) -> None:
    """Print the derived equations, regressor and filtered pieces, or what changed between two models."""
    from wheelpend.equations import describe, difference, other_model

    with failures(), progress("deriving"):
        opened = open_model(model, plant)
        say(difference(opened, other_model(opened, diff), latex) if diff else describe(opened, latex))


@app.command()
def verify(
    page: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Also write the findings as a Markdown page.")
    ] = None,
    json: Json = None,
) -> None:
    """Derived equations against every numbered equation of the paper: match, misprint or assumption."""
    from wheelpend.paper.page import page as page_of
    from wheelpend.paper.verification import verify as run
    from wheelpend.paper.wording import show_verification

    with failures(json):
        with progress("deriving and comparing 43 equations"):
            result = run()
        show(result, json, lambda: show_verification(result))
        if page is not None:
            write_text(page, page_of(result))


@app.command()
def reproduce(
    what: Annotated[str, typer.Argument(help="table1, table2, table3, figures or all.")] = "all",
    out: Annotated[Path, typer.Option(help="Folder for the tables, the pictures and gallery.html.")] = Path(
        "reproduction"
    ),
    seeds: Annotated[int, typer.Option(help="Draws of the sensor noise.")] = 100,
    json: Json = None,
) -> None:
    """The paper's tables and figures, its numbers beside ours over many seeds; writes CSV, PNG and one page."""
    from wheelpend.reproduction import run
    from wheelpend.reproduction import show as show_reproduction

    with failures(json):
        with progress("preparing the kernels") as update:
            result = run(what, out, seeds, progress=update)
        show(result, json, lambda: show_reproduction(result))


@app.command()
def generate(
    check: Annotated[bool, typer.Option("--check", help="Say what is stale and change nothing.")] = False,
    model: ModelFile = MODEL,
    plant: PlantFile = None,
) -> None:
    """Derive the model and write generated/."""
    from wheelpend import workspace
    from wheelpend.failures import Failure

    with failures(), progress("deriving the model"):
        opened = open_model(model, plant)
        if not check:
            workspace.generate_into(opened.workspace / "generated", opened)
            say(f"Wrote {opened.workspace / 'generated'}.")
            return
        difference = workspace.stale(opened)
        if difference:
            say(difference)
            raise Failure(f"{opened.workspace / 'generated'} must be what {opened.path} derives to, but it is stale. "
                          "Run `wheelpend generate`.")  # fmt: skip
        say(f"{opened.workspace / 'generated'} is up to date.")


@app.command()
def simulate(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="LOG", help="File to write, CSV or Parquet.")],
    command: Annotated[
        str, typer.Option(help="Reference of the pitch: simple, aggressive, upright, or a CSV file of `design`.")
    ] = "aggressive",
    duration: Annotated[
        float | None, typer.Option(help="Length [s]; 20, or that of the file.", show_default=False)
    ] = None,
    hide: Annotated[
        list[str] | None, typer.Option(help="NAME=VALUE or NAME=param:value,...; repeat for several.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the sensor noise.")] = 0,
    noise: Annotated[bool, typer.Option("--noise/--no-noise", help="Ideal sensors without --noise.")] = True,
    model: ModelFile = MODEL,
    plant: PlantFile = None,
) -> None:
    """Write a closed-loop measurement file, with hidden effects on request."""
    from wheelpend.logs import save_log
    from wheelpend.simulation import parse_hidden
    from wheelpend.simulation import simulate as run

    with failures(), progress("simulating"):
        opened, hidden = open_model(model, plant), parse_hidden(hide or [])
        made = run(opened, command=command, duration=duration, hide=hidden, seed=seed, noise=noise)
        save_log(output, made, table=opened.table)
        machine = "the machine of [simulation]" if opened.simulation else "the model as identified"
        extra = ", with " + ", ".join(f"{k} = {v:g}" for k, v in hidden.items()) if hidden else ""
        say(f"Wrote {output}: {machine}{extra}.")


@app.command()
def identify(
    logs: Logs,
    method: Annotated[
        str, typer.Option(help="shooting, filtered, iv, recursive, energy, inverse or differentiation.")
    ] = "shooting",
    tau: Annotated[
        str | None, typer.Option(metavar="T1,T2|auto", help="Time constants of the filters [s]; one for energy.")
    ] = None,
    hold: Annotated[
        str | None, typer.Option(help="zero or first: signals between samples, for filtered and recursive.")
    ] = None,
    forgetting: Annotated[float | None, typer.Option(help="Forgetting factor of recursive, 1 for none.")] = None,
    tau_map: Annotated[
        Path | None, typer.Option("--tau-map", metavar="PNG", help="Draw what --tau auto found.")
    ] = None,
    save: Annotated[bool, typer.Option("--save", help="Keep the values in the model file.")] = False,
    model: ModelFile = MODEL,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """Identify the parameters, with standard errors."""
    from wheelpend import wording
    from wheelpend.identification import identify as run

    with failures(json):
        times = parse_tau(tau, tau_map)
        with progress("reading") as update:
            result = run(
                open_model(model, plant),
                logs,
                method=method,
                tau=times,
                hold=hold,
                forgetting=forgetting,
                progress=update,
            )
        warn(result.warnings)
        show(result, json, lambda: wording.show_identification(result))
        if tau_map and result.guide:
            from wheelpend.filter_choice import draw

            draw(result.guide, tau_map)
        if save:
            result.model.save()


def parse_tau(text: str | None, tau_map: Path | None = None) -> tuple[float, ...] | Literal["auto"] | None:
    """Read T1,T2, or T, or auto; a map needs auto."""
    from wheelpend.failures import Failure

    if tau_map and text != "auto":
        raise Failure("--tau-map draws what --tau auto finds, but --tau is "
                      f"{'not given' if text is None else text}. Add --tau auto.")  # fmt: skip
    if text is None or text == "auto":
        return "auto" if text else None
    try:
        times = tuple(float(x) for x in text.split(","))
    except ValueError:
        raise Failure(f"--tau must be times in s such as 0.14,0.14, or auto, not '{text}'.") from None
    if not all(0 < t < 1e300 for t in times):
        raise Failure(f"--tau must be positive times in s, not '{text}'.")
    return times


@app.command()
def compare(
    logs: Logs, holdout: Holdout = None, model: ModelFile = MODEL, plant: PlantFile = None, json: Json = None
) -> None:
    """Model against measurements: fit per channel, error against horizon, closed loop, and where it fails."""
    from wheelpend import wording
    from wheelpend.comparison import compare as run

    with failures(json):
        opened = open_model(model, plant)
        check_logs(logs, opened)
        with progress("reading") as update:
            result = run(opened, logs, holdout or [], progress=update)
        warn(result.warnings)
        show(result, json, lambda: wording.show_comparison(result, opened))


def check_logs(logs: list[Path], model) -> None:
    """Say what is odd about the logs before any physics is blamed."""
    from wheelpend.inspection import inspect_for
    from wheelpend.study import read_logs

    for log in read_logs(logs, model):
        found = inspect_for(model, log)
        warn([f"{log.name}: {f.sentence} {f.cure}".strip() for f in found.findings])


@app.command()
def diagnose(
    logs: Logs,
    holdout: Holdout = None,
    without: Without = None,
    law: Law = False,
    accept: Accept = None,
    model: ModelFile = MODEL,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """Which physical effect is missing, ranked, with evidence. Changes nothing, unless a law is accepted."""
    from wheelpend import unexplained, wording
    from wheelpend.climb import diagnose as run

    with failures(json):
        opened = open_model(model, plant)
        unexplained.check_name(opened, accept)
        check_logs(logs, opened)
        with progress("reading") as update:
            asked = unexplained.Asked(law or accept is not None, accept is not None)
            result = run(opened, logs, holdout or [], without=without or [], law=asked.law, progress=update)
        warn(result.warnings)
        show(result, json, lambda: wording.show_diagnosis(result, opened, asked))
        unexplained.accept(opened, result.law, accept)


@app.command()
def add(
    effect: Annotated[str, typer.Argument(help="Name of the effect; `wheelpend effects` lists them.")],
    data: Data = None,
    holdout: Holdout = None,
    model: ModelFile = MODEL,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """Add an effect: re-derive, regenerate, refit, and show the error before and after."""
    from wheelpend.change import change

    change(effect, data or [], holdout or [], lambda: open_model(model, plant), json, remove=False)


@app.command()
def remove(
    effect: Annotated[str, typer.Argument(help="Name of the effect.")],
    data: Data = None,
    holdout: Holdout = None,
    model: ModelFile = MODEL,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """Remove an effect from the model; the opposite of add."""
    from wheelpend.change import change

    change(effect, data or [], holdout or [], lambda: open_model(model, plant), json, remove=True)


@app.command()
def explain(
    logs: Logs,
    holdout: Holdout = None,
    max_effects: Annotated[int, typer.Option(help="Add at most so many.", min=1, max=8)] = 4,
    without: Without = None,
    law: Law = False,
    accept: Accept = None,
    save: Annotated[bool, typer.Option("--save", help="Keep effects and values in the workspace.")] = False,
    model: ModelFile = MODEL,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """Diagnose and add in turn until nothing is missing; the error ladder."""
    from wheelpend import unexplained, wording
    from wheelpend.change import record
    from wheelpend.explanation import explain as run

    with failures(json):
        opened = open_model(model, plant)
        unexplained.check_name(opened, accept)
        check_logs(logs, opened)
        with progress("reading") as update:
            asked, left_out = unexplained.Asked(law or accept is not None, accept is not None), without or []
            result = run(
                opened, logs, holdout or [], max_effects=max_effects, without=left_out, law=asked.law, progress=update
            )
        warn(result.warnings)
        show(result, json, lambda: wording.show_explanation(result, asked))
        if save:
            record(result, logs, holdout or [])
        unexplained.accept(opened, result.law, accept)


@app.command()
def history(model: ModelFile = MODEL, plant: PlantFile = None, json: Json = None) -> None:
    """The error ladder of this workspace: every change and what it did to the error."""
    from wheelpend import workspace
    from wheelpend.wording import number

    with failures(json):
        entries = workspace.history(open_model(model, plant).workspace)

        def text() -> None:
            rows = [(e["change"], number(e.get("error_before")), number(e.get("error_after")),
                     ", ".join(e.get("logs", [])))
                    for e in entries]  # fmt: skip
            if rows:
                table("History", ("change", "error before", "error after", "logs"), rows)
            else:
                say("No change has been recorded yet.")

        show({"schema": 1, "history": entries}, json, text)


@app.command()
def design(
    logs: Annotated[
        list[Path] | None,
        typer.Argument(help="What is known already: logs, else those of the workspace's last change."),
    ] = None,
    between: Annotated[
        str | None, typer.Option(metavar="EFFECT,EFFECT", help="Two effects that it is to tell apart.")
    ] = None,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="CSV file to write.")] = Path(
        "designed.csv"
    ),
    pitch_limit: Annotated[float, typer.Option(metavar="RAD", help="Largest pitch of the robot [rad].")] = 0.4,
    voltage_limit: Annotated[
        float, typer.Option(metavar="V", help="Largest voltage [V], the answer to the sensors' noise included.")
    ] = 24.0,
    duration: Annotated[float, typer.Option(help="Length of the command [s].")] = 20.0,
    sample: Annotated[
        float | None, typer.Option(metavar="S", help="Sample interval [s]; that of the log, or 0.001.")
    ] = None,
    model: ModelFile = MODEL,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """A command that excites what the last log left open, within limits of pitch and voltage."""
    from wheelpend.design.words import run

    effects = tuple(e.strip() for e in between.split(",")) if between is not None else ()
    with failures(json):
        with progress("reading") as update:
            result = run(
                open_model(model, plant), logs or [], effects, output, pitch_limit=pitch_limit,
                voltage_limit=voltage_limit, duration=duration, sample=sample, progress=update,
            )  # fmt: skip
        show(result.to_json(), json, result.tell)


@app.command()
def campaign(
    logs: Annotated[
        list[Path] | None, typer.Argument(help="Measurement files, CSV or Parquet.", show_default=False)
    ] = None,
    simulate: Annotated[
        bool, typer.Option("--simulate", help="Simulate the logs instead, one with each seed.")
    ] = False,
    seeds: Annotated[int | None, typer.Option(help="Of --simulate: how many; 100.", min=1, show_default=False)] = None,
    command: Annotated[
        str | None, typer.Option(help="Of --simulate: as in `wheelpend simulate`; aggressive.", show_default=False)
    ] = None,
    duration: Annotated[
        float | None, typer.Option(help="Of --simulate: length [s]; 20, or that of the file.", show_default=False)
    ] = None,
    hide: Annotated[
        list[str] | None, typer.Option(help="Of --simulate: NAME=VALUE or NAME=param:value,...; repeat for several.")
    ] = None,
    do: Annotated[str, typer.Option(help="identify, compare, diagnose or explain.")] = "identify",
    method: Annotated[str, typer.Option(help="Of identify: as there.")] = "shooting",
    tau: Annotated[str | None, typer.Option(metavar="T1,T2|auto", help="Of identify: as there.")] = None,
    out: Annotated[Path, typer.Option(metavar="FILE", help="CSV file to write, one line per log.")] = Path(
        "campaign.csv"
    ),
    model: ModelFile = MODEL,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """The same question to many logs on all cores, and whether they agree; goes on where it was interrupted."""
    from wheelpend.campaigns.command import Simulated, run

    experiment = (seeds, command, duration, hide)
    if bool(logs) == simulate:
        raise typer.BadParameter("name measurement files, or simulate some with --simulate, but not both")
    if logs and any(given is not None for given in experiment):
        raise typer.BadParameter("--seeds, --command, --duration and --hide belong to --simulate")
    with failures(json):
        asked = Simulated(seeds or 100, command or "aggressive", duration, hide or []) if simulate else logs or []
        run(open_model(model, plant), asked, do, method, parse_tau(tau), out, json)


@app.command()
def report(
    logs: Logs,
    holdout: Holdout = None,
    output: Annotated[Path, typer.Option("-o", "--output", help="The page to write.")] = Path("report.html"),
    law: Law = False,
    model: ModelFile = MODEL,
    plant: PlantFile = None,
) -> None:
    """One self-contained HTML page with everything above."""
    from wheelpend.reporting import write_report
    from wheelpend.version import version

    with failures():
        from wheelpend.explanation import explain as run

        with progress("reading") as update:
            result = run(open_model(model, plant), logs, holdout or [], law=law, progress=update)
        parts = ["wheelpend report", *map(str, logs), *(f"--holdout {h}" for h in holdout or []), *["--law"] * law]
        command = " ".join(parts)
        say(f"Wrote {write_report(result, output, version=version(), command=command)}.")


@app.command()
def effects(
    effect: Annotated[str | None, typer.Argument(help="One effect.", show_default=False)] = None,
    model: ModelFile = MODEL,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """The effects that the model's plant may have, and your own: name, family, sentence, unit, equation."""
    import derive
    from wheelpend.failures import Failure

    with failures(json):
        known, suited = derive.effects.all_with(), lambda row: row
        if model != MODEL or model.exists():
            opened = open_model(model, plant)
            built = opened.nameplate
            known, suited = derive.effects.possible_on(built, opened.own), lambda row: derive.effects.suited(row, built)
        try:
            rows = [suited(e) for e in ([derive.effects.find(effect)] if effect else known)]
        except KeyError as error:
            raise Failure(error.args[0]) from None
        data = [
            {"effect": e.name, "family": e.family, "sentence": e.sentence, "equation": e.equation, "means": e.means,
             "parameters": [{"name": p.name, "unit": p.unit, "scope": e.scope_of(p)} for p in e.parameters]}
            for e in rows
        ]  # fmt: skip

        def text() -> None:
            units = [", ".join(f"{p.name} [{p.unit}]" for p in e.parameters) for e in rows]
            cells = [(e.name, e.family, e.sentence, u, e.equation) for e, u in zip(rows, units, strict=True)]
            table("Effects", ("effect", "family", "what it is", "parameters", "law"), cells)
            if effect:
                say(rows[0].means)

        show({"schema": 1, "effects": data}, json, text)


@app.command(name="inspect")
def inspect_(
    log: Annotated[Path, typer.Argument(help="Measurement file.")],
    model: ModelFile = MODEL,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """Rate, jitter, gaps, ranges and noise of a log; time shifts, flipped signs; proposes [columns] and [sensors]."""
    from wheelpend.inspection import inspect_file
    from wheelpend.wording import show_inspection

    with failures(json):
        opened = open_model(model, plant)
        with progress("reading"):
            loaded, result = inspect_file(opened, log)
        warn(loaded.warnings)
        show(result.to_json(), json, lambda: show_inspection(loaded, result))


@app.command()
def warm(model: ModelFile = MODEL, plant: PlantFile = None) -> None:
    """Compile the kernels ahead of time."""
    from time import monotonic

    from wheelpend.warm import compile_all

    with failures(), progress("compiling") as update:
        opened, begin = open_model(model, plant), monotonic()
        found = compile_all(opened, update)
        seconds = f"{monotonic() - begin:.0f} s"
        say(f"Compiled the kernels of the {', the '.join(found)} in {seconds}." if found else
            f"Every kernel of {opened.path} was compiled already; loading them all took {seconds}.")  # fmt: skip
        say(f"The machine code is kept in {_cache()}, where every later run finds it.")


def _cache() -> Path:
    from wheelpend.cache import cache_folder

    return cache_folder()


def main() -> None:
    """Entry point of the `wheelpend` command."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy is loaded; in small problems more are in the way
    gc.set_threshold(100_000)  # what modules leave while they load is kept: to look for garbage there costs a tenth
    app()


__all__ = ["app", "console", "main"]
