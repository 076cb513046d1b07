"""Commands on logs alone: simulate, inspect, design, campaign."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from wheelpend.cli.app import app
from wheelpend.cli.next_step import Asked, say_after_campaign
from wheelpend.cli.options import (
    DEFAULT_MODEL_PATH,
    CampaignDiffer,
    CampaignLogs,
    CampaignMethod,
    CampaignReport,
    CampaignScheduler,
    CampaignTable,
    CampaignTask,
    CampaignTau,
    CampaignThen,
    Interval,
    Json,
    ModelFile,
    PlantFile,
    SimulatedCommand,
    SimulatedDuration,
    SimulatedEffects,
    SimulatedSeeds,
    SimulateLogs,
    open_model,
    parse_tau,
)
from wheelpend.errors import Failure
from wheelpend.reports.console import (
    exit_on_failure,
    print_line,
    print_result,
    print_text,
    print_warnings,
    progress,
)
from wheelpend.reports.outputs import check_output


@app.command()
def simulate(
    output: Annotated[
        Path, typer.Option("-o", "--out", "--output", metavar="LOG", help="File to write, CSV or Parquet.")
    ],
    command: Annotated[
        str,
        typer.Option(help="What is to be followed: simple, aggressive, upright, or a CSV file of `design`."),
    ] = "aggressive",
    duration: Annotated[
        float | None, typer.Option(help="Length [s]; 20, or that of the file.", show_default=False)
    ] = None,
    hide: Annotated[
        list[str] | None, typer.Option(help="NAME=VALUE or NAME=param:value,...; repeat for several.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the sensor noise.", min=0)] = 0,
    noise: Annotated[bool, typer.Option("--noise/--no-noise", help="Ideal sensors without --noise.")] = True,
    model: ModelFile = DEFAULT_MODEL_PATH,
    plant: PlantFile = None,
) -> None:
    """Write a closed-loop measurement file, with hidden effects on request."""
    # imported late: the list of commands needs neither logs nor NumPy
    from wheelpend.logs.read import save_log
    from wheelpend.simulation.hidden import parse_hidden
    from wheelpend.simulation.simulate import simulate as run

    with exit_on_failure(None, output), progress("simulating"):
        opened, hidden = open_model(model, plant), parse_hidden(hide or [])
        made = run(opened, command=command, duration=duration, hide=hidden, seed=seed, noise=noise)
        save_log(output, made, table=opened.table)
        machine = "the machine of [simulation]" if opened.simulation else "the model as identified"
        extra = ", with " + ", ".join(f"{k} = {v:g}" for k, v in hidden.items()) if hidden else ""
        print_line(f"Wrote {output}: {machine}{extra}.")
    Asked([output], (), model, plant).say_next("how well the model predicts it, and where it fails", "compare")


@app.command()
def design(
    logs: Annotated[
        list[Path] | None,
        typer.Argument(help="What is known already: logs, else those of the workspace's last change."),
    ] = None,
    between: Annotated[
        str | None, typer.Option(metavar="EFFECT,EFFECT", help="Two effects that it is to tell apart.")
    ] = None,
    output: Annotated[Path, typer.Option("-o", "--out", "--output", metavar="FILE", help="CSV file to write.")] = Path(
        "designed.csv"
    ),
    pitch_limit: Annotated[
        float | None,
        typer.Option(metavar="RAD", help="Largest angle from upright [rad]; the plant's own."),
    ] = None,
    voltage_limit: Annotated[
        float | None,
        typer.Option(metavar="V", help="Largest input, the answer to the sensors' noise included."),
    ] = None,
    duration: Annotated[float, typer.Option(help="Length of the command [s].")] = 20.0,
    sample: Annotated[
        float | None, typer.Option(metavar="S", help="Sample interval [s]; that of the log, or 0.001.")
    ] = None,
    model: ModelFile = DEFAULT_MODEL_PATH,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """A command that excites what the last log left open, within limits of angle and input."""
    from wheelpend.cli.design import write_design  # imported late: loads NumPy and Numba

    effects = tuple(e.strip() for e in between.split(",")) if between is not None else ()
    with exit_on_failure(json, output):
        with progress("reading") as update:
            result = write_design(
                open_model(model, plant), logs or [], effects, output, pitch_limit=pitch_limit,
                voltage_limit=voltage_limit, duration=duration, sample=sample, progress=update,
            )  # fmt: skip
        print_result(result, json, lambda: print_text(result.text()))
        asked = Asked([Path(name) for name in result.logs], (), model, plant, json)
        play = ("simulate", "-o", "log.csv", "--command", str(result.path))
        asked.without_files.say_next("try it on the simulated machine", *play)
        asked._replace(logs=[*asked.logs, Path("log.csv")]).say_next(
            "what the log of it tells beside these", "diagnose"
        )


@app.command()
def campaign(
    logs: CampaignLogs = None,
    simulate: SimulateLogs = False,
    seeds: SimulatedSeeds = None,
    command: SimulatedCommand = None,
    duration: SimulatedDuration = None,
    hide: SimulatedEffects = None,
    do: CampaignTask = "identify",
    method: CampaignMethod = "filter_error",
    tau: CampaignTau = None,
    out: CampaignTable = Path("campaign.csv"),
    differ: CampaignDiffer = None,
    then: CampaignThen = None,
    report: CampaignReport = None,
    scheduler: CampaignScheduler = None,
    model: ModelFile = DEFAULT_MODEL_PATH,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """The same question to many logs on all cores, and whether they agree; goes on where it was interrupted."""
    from wheelpend.cli.campaign import CampaignRequest, SimulationRequest, run_campaign  # imported late: loads Numba

    experiment = (seeds, command, duration, hide)
    if bool(logs) == simulate:
        raise typer.BadParameter("name measurement files, or simulate some with --simulate, but not both")
    if (differ or report or then) and simulate:
        raise typer.BadParameter(
            "--differ, --then and --report are about the units of a manifest; simulated logs have none"
        )
    if logs and any(given is not None for given in experiment):
        raise typer.BadParameter("--seeds, --command, --duration and --hide belong to --simulate")
    with exit_on_failure(json):
        # what an earlier campaign wrote is left out of the logs, so that it may be among them
        check_output(out, may_be_given=True)
        simulation = SimulationRequest(seeds or 100, command or "aggressive", duration, hide or [])
        source = simulation if simulate else logs or []
        if report is not None:
            check_output(report)
        request = CampaignRequest(source, do, method, parse_tau(tau), out, differ or (), report, then, scheduler)
        result = run_campaign(open_model(model, plant), request, json)
        say_after_campaign(Asked(logs or [], (), model, plant, json), result)


@app.command(name="inspect")
def inspect_(
    log: Annotated[Path, typer.Argument(help="Measurement file.")],
    model: ModelFile = DEFAULT_MODEL_PATH,
    plant: PlantFile = None,
    interval: Interval = None,
    json: Json = None,
) -> None:
    """Rate, jitter, gaps, ranges and noise of a log; time shifts, flipped signs; proposes [columns] and [sensors].

    Without a model, what the columns are, which plant has them, and the model.toml to begin with.
    """
    # imported late: the list of commands needs neither logs nor NumPy
    from wheelpend.inspection.inspect import inspect_file
    from wheelpend.logs.columns import ROW_NUMBER
    from wheelpend.reports.text.inspection import inspection_text

    with exit_on_failure(json):
        if model == DEFAULT_MODEL_PATH and not model.exists():
            inspect_without_model(log, plant, interval, json)
            return
        if interval is not None:
            entry = f'columns.t={{ column = "{ROW_NUMBER}", scale = {interval!r} }}'
            raise Failure("--interval must come without a model, which says itself what the times are. Set them: "
                          f"`wheelpend set '{entry}'`.")  # fmt: skip
        opened = open_model(model, plant)
        with progress("reading"):
            loaded, result = inspect_file(opened, log)
        print_warnings([w for w in loaded.warnings if not any(f.sentence in w for f in result.findings)])
        print_result(result, json, lambda: print_text(inspection_text(loaded, result)))
        Asked([log], (), model, plant, json).say_next("how well the model predicts it, and where it fails", "compare")


@app.command()
def split(
    log: Annotated[Path, typer.Argument(help="Measurement file.")],
    begin: Annotated[float, typer.Option("--from", metavar="S", help="Where it begins [s], from the first sample on.")],
    end: Annotated[float, typer.Option("--to", metavar="S", help="Where it ends [s].")],
    out: Annotated[
        Path, typer.Option("-o", "--out", "--output", metavar="FOLDER", help="Where the two files are written.")
    ] = Path("."),
    model: ModelFile = DEFAULT_MODEL_PATH,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """Hold a stretch of a log out: one file with it, that judges, and one with the rest, to be fitted to."""
    # imported late: the list of commands needs neither logs nor NumPy
    from wheelpend.inspection.split import split_log, split_paths
    from wheelpend.reports.text.split import split_lines

    with exit_on_failure(json):
        for path in split_paths(log, begin, end, out):
            check_output(path)
        opened = open_model(model, plant) if model != DEFAULT_MODEL_PATH or model.exists() else None
        clock = opened.columns.get("t") if opened else None
        with progress("reading"):
            found = split_log(log, begin, end, out, clock)
        print_result(found, json, lambda: print_text(split_lines(found)))
        asked = Asked([found.rest], [found.held_out], model, plant, json)
        asked.say_next("how well the model predicts what was held out", "compare")


def inspect_without_model(log: Path, plant: Path | None, interval: float | None, json: str | None) -> None:
    """Look at a log where there is no model, for a plant of the user's own where one is named."""
    # imported late, as above
    from wheelpend.inspection.first_look import first_look
    from wheelpend.model.user_plants import plant_name
    from wheelpend.reports.text.first_look import first_look_text

    with progress("reading"):
        look = first_look(log, plant_name(str(plant)) if plant else "", interval)
    findings = look.inspection.findings if look.inspection else ()
    warnings = look.log.warnings if look.log else ()
    print_warnings([w for w in warnings if not any(f.sentence in w for f in findings)])
    print_result(look, json, lambda: print_text(first_look_text(look)))
    if look.model and not look.refusal:
        asked = Asked((), (), DEFAULT_MODEL_PATH, plant, json)
        own = ("--interval", repr(interval)) if interval else ()
        asked.say_next("a workspace that begins with this", "new", "robot", "--from", str(log), *own)
