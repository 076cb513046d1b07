"""Commands of a workspace: new, set, equations, generate, history, effects, warm."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from derive import plants
from wheelpend.cli.app import app
from wheelpend.cli.next_step import Asked
from wheelpend.cli.options import DEFAULT_MODEL_PATH, Interval, Json, ModelFile, PlantFile, open_model, opened_to_change
from wheelpend.errors import Failure
from wheelpend.reports.console import exit_on_failure, print_line, print_result, print_text, progress

if TYPE_CHECKING:
    from derive.effects import Effect


@app.command()
def new(
    folder: Annotated[Path, typer.Argument(help="Where to start the workspace.")] = Path(),
    plant: Annotated[
        str | None,
        typer.Option(
            help=f"{', '.join(plants.KNOWN_PLANTS)}, or a plant of your own: FILE.py; "
            f"{plants.DEFAULT_PLANT}, or the one that --from suggests.",
            show_default=False,
        ),
    ] = None,
    log: Annotated[
        Path | None,
        typer.Option("--from", metavar="LOG", help="As `inspect` proposes for this log.", show_default=False),
    ] = None,
    interval: Interval = None,
) -> None:
    """Start a workspace with the paper's model, another plant's, or as a log suggests: model.toml and generated/."""
    # imported late, as in every command: the list of commands needs neither tomlkit nor SymPy
    from wheelpend.model import workspace
    from wheelpend.model.user_plants import plant_name

    with exit_on_failure(), progress("deriving the model"):
        workspace.check_new(folder)
        name = plant_name(plant) if plant else ""
        if interval and not log:
            raise Failure("--interval must come with --from LOG, whose rows it is between.")
        text = proposed_text(log, name, interval) if log else ""
        model = workspace.create(folder, name or plants.DEFAULT_PLANT, text)
        again = f" --plant {plant}" if plant and plant.endswith(".py") else ""
        then = f"compare {log.resolve()}" if log else "simulate -o log.csv"
        print_line(f"Started {model.path} with its generated code. Try `wheelpend {then}{again}` there.")


def proposed_text(log: Path, plant: str, interval: float | None) -> str:
    """The model.toml that inspection proposes for a log; raises Failure where the log cannot be read so."""
    from wheelpend.inspection.first_look import first_look  # imported late, as above

    look = first_look(log, plant, interval)
    if look.refusal and not look.proposal.missing:
        raise Failure(look.refusal)
    for name, advice in look.proposal.missing.items():
        print_line(f"- {name} is {advice}, in model.toml.")
    for finding in look.inspection.findings if look.inspection else ():
        print_line(f"- {finding.sentence} {finding.cure}")
    for name, reason in look.guesses.items():
        print_line(f"- {name} is guessed, and marked so in model.toml: {reason}.")
    return look.model


@app.command(name="set")
def set_(
    settings: Annotated[
        list[str], typer.Argument(metavar="KEY=VALUE...", help="Such as columns.theta_p.sign=-1; KEY= takes it out.")
    ],
    model: ModelFile = DEFAULT_MODEL_PATH,
    plant: PlantFile = None,
) -> None:
    """Correct model.toml: columns, sensors, controller, input, constants, assumptions, nominal values."""
    # imported late, as in every command
    from wheelpend.model import workspace
    from wheelpend.model.settings import Setting, changes, changes_equations, with_settings
    from wheelpend.reports.text.settings import change_lines

    with exit_on_failure(), opened_to_change(model, plant) as opened:
        wanted = [Setting.parse(text) for text in settings]
        changed = with_settings(opened, wanted)
        if is_other := changes_equations(opened, changed):
            with progress("deriving the model"):
                workspace.save(changed, opened=opened)
        elif changed.text != opened.text:
            workspace.save_values(opened, changed)
        print_text(change_lines(changes(opened, changed, wanted), opened.path, regenerated=is_other))


@app.command()
def equations(
    latex: Annotated[bool, typer.Option("--latex", help="Print LaTeX.")] = False,
    diff: Annotated[
        str | None,
        typer.Option(metavar="OTHER", help="Print what changes: OTHER is a model file, or ASSUMPTION=CHOICE."),
    ] = None,
    model: ModelFile = DEFAULT_MODEL_PATH,
    plant: PlantFile = None,
) -> None:
    """Print the derived equations, regressor and filtered pieces, or what changed between two models."""
    from wheelpend.model.equations import difference_text, equations_text, other_model

    with exit_on_failure(), progress("deriving"):
        opened = open_model(model, plant)
        print_line(difference_text(opened, other_model(opened, diff), latex) if diff else equations_text(opened, latex))


@app.command()
def generate(
    check: Annotated[bool, typer.Option("--check", help="Say what is stale and change nothing.")] = False,
    model: ModelFile = DEFAULT_MODEL_PATH,
    plant: PlantFile = None,
) -> None:
    """Derive the model and write generated/."""
    from wheelpend.model import workspace

    with exit_on_failure(), progress("deriving the model"), opened_to_change(model, plant, not check) as opened:
        if not check:
            print_line(f"Wrote {workspace.generate(opened)}.")
            refit = "its parameters from your logs, with standard errors"
            Asked((), (), model, plant).say_next(refit, "identify", "LOG", "--save")
            return
        difference = workspace.generated_code_diff(opened)
        if difference:
            print_line(difference)
            raise Failure(f"{opened.workspace / 'generated'} must be what {opened.path} derives to, but it is stale. "
                          "Run `wheelpend generate`.")  # fmt: skip
        print_line(f"{opened.workspace / 'generated'} is up to date.")


@app.command()
def history(model: ModelFile = DEFAULT_MODEL_PATH, plant: PlantFile = None, json: Json = None) -> None:
    """The error ladder of this workspace: every change and what it did to the error."""
    from wheelpend.model import workspace
    from wheelpend.reports.text.history import history_block  # imported late: loads NumPy

    with exit_on_failure(json):
        entries = workspace.history(open_model(model, plant).workspace)
        print_result({"schema": 1, "history": entries}, json, lambda: print_text([history_block(entries)]))


@app.command()
def effects(
    effect: Annotated[str | None, typer.Argument(help="One effect.", show_default=False)] = None,
    define: Annotated[
        Path | None,
        typer.Option(metavar="FILE.toml", help="Effects of your own that become the workspace's, all or none of them."),
    ] = None,
    model: ModelFile = DEFAULT_MODEL_PATH,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """The effects that the model's plant may have, and your own: name, family, sentence, unit, equation."""
    # imported late: the library
    from wheelpend.reports.text.effects import effect_json, effects_text, listed_effects

    with exit_on_failure(json):
        if define is not None:
            rows = defined_effects(define, model, plant)
        else:
            opened = open_model(model, plant) if model != DEFAULT_MODEL_PATH or model.exists() else None
            rows = listed_effects(opened, effect)
        result = {"schema": 1, "effects": list(map(effect_json, rows))}
        print_result(result, json, lambda: print_text(effects_text(rows, in_detail=effect is not None)))


def defined_effects(file: Path, path: Path, plant: Path | None) -> list[Effect]:
    """The effects of a file, which are in a workspace's effects.toml from now on; raises Failure, and changes nothing,
    where one of them is wrong or has a name that is taken.
    """
    from wheelpend.model.user_effects import define_user_effects  # imported late, as above
    from wheelpend.reports.text.effects import listed_effects

    with opened_to_change(path, plant) as opened:
        names = define_user_effects(opened.workspace, file, opened.plant_signature)
        changed = open_model(path, plant)
    return [row for name in names for row in listed_effects(changed, name)]


@app.command()
def warm(model: ModelFile = DEFAULT_MODEL_PATH, plant: PlantFile = None) -> None:
    """Compile the kernels ahead of time."""
    from time import monotonic

    from wheelpend.kernels.cache_folder import cache_folder
    from wheelpend.model.precompile import compile_all

    with exit_on_failure(), progress("compiling") as update:
        opened, begin = open_model(model, plant), monotonic()
        found = compile_all(opened, update)
        seconds = f"{monotonic() - begin:.0f} s"
        print_line(f"Compiled the kernels of the {', the '.join(found)} in {seconds}." if found else
            f"Every kernel of {opened.path} was compiled already; loading them all took {seconds}.")  # fmt: skip
        print_line(f"The machine code is kept in {cache_folder()}, where every later run finds it.")
