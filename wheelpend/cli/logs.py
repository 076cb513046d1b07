"""Commands on logs alone: simulate, inspect, design, campaign."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from wheelpend.cli.app import app
from wheelpend.cli.options import DEFAULT_MODEL_PATH, Json, ModelFile, PlantFile, open_model, parse_tau
from wheelpend.reports.console import exit_on_failure, print_line, print_result, print_warnings, progress


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
    model: ModelFile = DEFAULT_MODEL_PATH,
    plant: PlantFile = None,
) -> None:
    """Write a closed-loop measurement file, with hidden effects on request."""
    from wheelpend.logs.read import save_log
    from wheelpend.simulation.hidden import parse_hidden
    from wheelpend.simulation.simulate import simulate as run

    with exit_on_failure(), progress("simulating"):
        opened, hidden = open_model(model, plant), parse_hidden(hide or [])
        made = run(opened, command=command, duration=duration, hide=hidden, seed=seed, noise=noise)
        save_log(output, made, table=opened.table)
        machine = "the machine of [simulation]" if opened.simulation else "the model as identified"
        extra = ", with " + ", ".join(f"{k} = {v:g}" for k, v in hidden.items()) if hidden else ""
        print_line(f"Wrote {output}: {machine}{extra}.")


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
    model: ModelFile = DEFAULT_MODEL_PATH,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """A command that excites what the last log left open, within limits of pitch and voltage."""
    from wheelpend.reports.text.design import write_design

    effects = tuple(e.strip() for e in between.split(",")) if between is not None else ()
    with exit_on_failure(json):
        with progress("reading") as update:
            result = write_design(
                open_model(model, plant), logs or [], effects, output, pitch_limit=pitch_limit,
                voltage_limit=voltage_limit, duration=duration, sample=sample, progress=update,
            )  # fmt: skip
        print_result(result.to_json(), json, result.print_summary)


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
    model: ModelFile = DEFAULT_MODEL_PATH,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """The same question to many logs on all cores, and whether they agree; goes on where it was interrupted."""
    from wheelpend.cli.campaign import SimulationRequest, run_campaign

    experiment = (seeds, command, duration, hide)
    if bool(logs) == simulate:
        raise typer.BadParameter("name measurement files, or simulate some with --simulate, but not both")
    if logs and any(given is not None for given in experiment):
        raise typer.BadParameter("--seeds, --command, --duration and --hide belong to --simulate")
    with exit_on_failure(json):
        asked = (
            SimulationRequest(seeds or 100, command or "aggressive", duration, hide or []) if simulate else logs or []
        )
        run_campaign(open_model(model, plant), asked, do, method, parse_tau(tau), out, json)


@app.command(name="inspect")
def inspect_(
    log: Annotated[Path, typer.Argument(help="Measurement file.")],
    model: ModelFile = DEFAULT_MODEL_PATH,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """Rate, jitter, gaps, ranges and noise of a log; time shifts, flipped signs; proposes [columns] and [sensors]."""
    from wheelpend.inspection.inspect import inspect_file
    from wheelpend.reports.text.inspection import print_inspection

    with exit_on_failure(json):
        opened = open_model(model, plant)
        with progress("reading"):
            loaded, result = inspect_file(opened, log)
        print_warnings(loaded.warnings)
        print_result(result.to_json(), json, lambda: print_inspection(loaded, result))
