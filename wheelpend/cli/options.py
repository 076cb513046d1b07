"""Arguments and options that several commands share."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from wheelpend.errors import Failure, require
from wheelpend.reports.console import print_warnings

if TYPE_CHECKING:
    from wheelpend.model.record import Model

MAX_SEEDS = 100_000  # draws of noise, each a simulation or more

Logs = Annotated[list[Path], typer.Argument(help="Measurement files: CSV, Parquet, MATLAB, bags.", show_default=False)]
Holdout = Annotated[list[Path] | None, typer.Option("--holdout", help="A log that no fit sees; repeat for several.")]
Against = Annotated[
    list[Path] | None, typer.Option("--against", metavar="OTHER.toml", help="Another model; repeat for several.")
]
Without = Annotated[list[str] | None, typer.Option("--without", help="An effect not to try; repeat for several.")]
Law = Annotated[bool, typer.Option("--law", help="Fit a free-form law to what no effect explains; takes a minute.")]
Accept = Annotated[
    str | None, typer.Option("--accept", metavar="NAME", help="Write that law to effects.toml as an effect of yours.")
]
Data = Annotated[list[Path] | None, typer.Option("--data", help="The same, by an option.")]
OptionalLogs = Annotated[
    list[Path] | None, typer.Argument(help="Measurement files: CSV, Parquet, MATLAB, bags.", show_default=False)
]
RefitLogs = Annotated[list[Path] | None, typer.Argument(help="Logs to refit on.", show_default=False)]
ModelFile = Annotated[Path, typer.Option("--model", help="The model file, or its folder.")]
Interval = Annotated[
    float | None,
    typer.Option("--interval", metavar="S", min=1e-9, help="Seconds from row to row, of a log without usable times."),
]
Json = Annotated[
    str | None, typer.Option("--json", metavar="FILE", help="Write the result as JSON; '-' is standard output.")
]
PlantFile = Annotated[
    Path | None,
    typer.Option("--plant", metavar="FILE.py", help="A plant of your own: Python code, run because it is named here."),
]

# of explain and report
MAX_EFFECTS = 4
MaxEffects = Annotated[int, typer.Option(help="Add at most so many.", min=1, max=8)]
SaveExplanation = Annotated[bool, typer.Option("--save", help="Keep effects and values in the workspace.")]

# of identify
Method = Annotated[
    str, typer.Option(help="filter_error, shooting, filtered, iv, recursive, energy, inverse or differentiation.")
]
Tau = Annotated[
    str | None, typer.Option(metavar="T1,T2|auto", help="Time constants of the filters [s]; one for energy.")
]
Hold = Annotated[str | None, typer.Option(help="zero or first: signals between samples, for filtered and recursive.")]
Forgetting = Annotated[float | None, typer.Option(help="Forgetting factor of recursive, 1 for none.")]
Fix = Annotated[
    list[str] | None, typer.Option("--fix", metavar="NAME=VALUE", help="A parameter's known value; repeat for several.")
]
Bound = Annotated[
    list[str] | None,
    typer.Option("--bound", metavar="NAME=LOW:HIGH", help="Bounds, of which one may be left out; repeat for several."),
]
TauMap = Annotated[Path | None, typer.Option("--tau-map", metavar="PNG", help="Draw what --tau auto found.")]

# of campaign
CampaignLogs = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="[LOG]...",
        help="Measurement files, patterns, addresses (s3://, https://), or a manifest: a table with the columns log, "
        "and unit or date.",
        show_default=False,
    ),
]
SimulateLogs = Annotated[bool, typer.Option("--simulate", help="Simulate the logs instead, one with each seed.")]
SimulatedSeeds = Annotated[
    int | None, typer.Option(help="Of --simulate: how many; 100.", min=1, max=MAX_SEEDS, show_default=False)
]
SimulatedCommand = Annotated[
    str | None, typer.Option(help="Of --simulate: as in `wheelpend simulate`; aggressive.", show_default=False)
]
SimulatedDuration = Annotated[
    float | None, typer.Option(help="Of --simulate: length [s]; 20, or that of the file.", show_default=False)
]
SimulatedEffects = Annotated[
    list[str] | None, typer.Option(help="Of --simulate: NAME=VALUE or NAME=param:value,...; repeat for several.")
]
CampaignTask = Annotated[str, typer.Option(help="identify, compare, diagnose or explain.")]
CampaignMethod = Annotated[str, typer.Option(help="Of identify: as there.")]
CampaignTau = Annotated[str | None, typer.Option(metavar="T1,T2|auto", help="Of identify: as there.")]
CampaignDiffer = Annotated[
    tuple[str, str] | None,
    typer.Option(metavar="UNIT UNIT", help="Why these two units of a manifest differ.", show_default=False),
]
CampaignThen = Annotated[
    str | None,
    typer.Option(
        metavar="diagnose|explain", help="Ask this too, of the units of a manifest that stand out.", show_default=False
    ),
]
CampaignReport = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.html", help="Also a page on the fleet: its units, maps, what drifts.", show_default=False
    ),
]
CampaignScheduler = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="A Dask cluster to use in place of this machine's cores; it is trusted with code.",
        show_default=False,
    ),
]
CampaignTable = Annotated[
    Path, typer.Option("-o", "--out", metavar="FILE", help="CSV file to write, one line per log.")
]

DEFAULT_MODEL_PATH = Path("model.toml")


def open_model(path: Path, plant: Path | None = None) -> Model:
    """Open the model named on the command line; its plant may be that of a file of the user's own, named there too."""
    from wheelpend.model.record import Model  # imported late: loads tomlkit

    if plant is not None:
        from wheelpend.model.user_plants import load_plant  # imported late: loads SymPy

        load_plant(plant)
    return Model.open(path)


@contextmanager
def opened_to_change(path: Path, plant: Path | None = None, changes: bool = True) -> Iterator[Model]:
    """The model named on the command line, which no other command may change before the block has ended.

    That is so only where this command ``changes`` it.
    """
    from wheelpend.model.transaction import held

    with held(path if path.is_dir() else path.parent) if changes else nullcontext():
        yield open_model(path, plant)


def parse_tau(text: str | None, tau_map: Path | None = None) -> tuple[float, ...] | Literal["auto"] | None:
    """Time constants [s] from T1,T2, or T, or auto; raises Failure for others, and for a map without auto."""
    if tau_map:
        require("matplotlib", "plots", "--tau-map")
    if tau_map and text != "auto":
        raise Failure("--tau-map draws what --tau auto finds, but --tau is "
                      f"{'not given' if text is None else text}. Add --tau auto.")  # fmt: skip
    if text is None or text == "auto":
        return "auto" if text else None
    try:
        times = tuple(float(x) for x in text.split(","))
    except ValueError:
        raise Failure(f"--tau must be times in s such as 0.14,0.14, or auto, not '{text}'.") from None
    if not all(0 < t < float("inf") for t in times):
        raise Failure(f"--tau must be positive times in s, not '{text}'.")
    return times


def parse_fixed(texts: list[str]) -> dict[str, float]:
    """Values by name from NAME=VALUE; raises Failure for others, and for a name that comes twice."""
    return {n: _number(value, f"--fix {n}={value}") for n, value in _assignments("--fix", "VALUE", texts)}


def parse_bounds(texts: list[str]) -> dict[str, tuple[float | None, float | None]]:
    """Lower and upper bound by name from NAME=LOW:HIGH, of which one may be empty; raises Failure for others."""
    found = {}
    for name, text in _assignments("--bound", "LOW:HIGH", texts):
        low, colon, high = text.partition(":")
        if not colon or not (low.strip() or high.strip()):
            raise Failure(f"--bound must be NAME=LOW:HIGH, of which one may be left out, not '{name}={text}'. "
                          f"Write --bound {name}=0:1 or --bound {name}=0:.")  # fmt: skip
        sides = [_number(s, f"--bound {name}={text}") if s.strip() else None for s in (low, high)]
        found[name] = (sides[0], sides[1])
    return found


def _assignments(option: str, form: str, texts: list[str]) -> Iterator[tuple[str, str]]:
    """Name and text of each NAME=text; raises Failure where there is no '=', and for a name that comes twice."""
    passed = set()
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not equals or not name:
            raise Failure(
                f"{option} must be NAME={form}, such as X5={'4.7' if form == 'VALUE' else '0:10'}, not '{text}'."
            )
        if name in passed:
            raise Failure(f"{option} must name each parameter once, but {name} is there twice. Leave one out.")
        passed.add(name)
        yield name, value


def _number(text: str, option: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise Failure(f"{option} must give numbers, but '{text.strip()}' is none.") from None


def print_log_findings(logs: Sequence[Path], model: Model, holdout: Sequence[Path] | None = None) -> list[str]:
    """Print what inspection finds in logs, those held out too, as warnings before a result; returns what was said."""
    # imported late: the list of commands needs neither logs nor NumPy
    from wheelpend.estimation.data import read_logs
    from wheelpend.inspection.inspect import inspect_for_model

    said = []
    for log in read_logs([*logs, *(holdout or [])], model):
        findings = [f for f in inspect_for_model(model, log).findings if not log.has_said(f.sentence)]
        said += [f"{log.name}: {f.sentence} {f.cure}".strip() for f in findings]
    print_warnings(said)
    return said
