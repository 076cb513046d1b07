"""Runs a reproduction: plans the seeds, computes on all cores, assembles the tables and writes the files."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from wheelpend.durations import duration_text
from wheelpend.errors import Failure, did_you_mean, require
from wheelpend.model.record import Model
from wheelpend.parallel import run_all
from wheelpend.reproduction import choices, tables
from wheelpend.reproduction.choices import ChoiceEffect
from wheelpend.reproduction.experiment import COMMAND_NAMES, EXPERIMENT_DURATION_S, Setup, load_robot, unstable_pole
from wheelpend.reproduction.record import Reproduction
from wheelpend.reproduction.tables import Cell, Deviation
from wheelpend.reproduction.trials import Task, Trial, run_task

REPRODUCTION_PARTS = ("table1", "table2", "table3", "figures", "all")
FILTERED_METHODS = ("filtered_zoh", "filtered_foh", "filtered_rest", "filtered_still", "filtered_free")
BETTER_METHODS = ("iv", "shooting", "cramer_rao")
TABLE_METHODS: dict[str, dict[str, tuple[str, ...]]] = {  # of each table: command and its methods, in order
    "table1": {"simple": ("differentiation", "filtered_zoh", "filtered_foh", *BETTER_METHODS)},
    "table2": dict.fromkeys(COMMAND_NAMES, ("filtered_zoh", "filtered_foh", *BETTER_METHODS)),
}
CONDITION_SEED_COUNT = 20  # seeds of which condition numbers and bounds are computed: they hardly differ between seeds


class Noiseless(NamedTuple):
    """Results that need no seeds."""

    table3: tuple[Deviation, ...]
    effects: tuple[dict[str, tuple[ChoiceEffect, ...]], ...]  # by choice


def run(
    what: str = "all",
    out: Path = Path("reproduction"),
    seeds: int = 100,
    progress: Callable[[str], None] = lambda text: None,
    model: Model | None = None,
) -> Reproduction:
    """Reproduce a part of the paper and write its CSV tables, PNG figures and the gallery into a folder.

    ``model`` is the paper's unless one is given; its [simulation] is the machine. On several cores the seeds run in
    processes of their own, so a script that calls this needs the usual ``if __name__ == "__main__":``. Raises Failure
    for an unknown part, fewer than one seed, and where the files cannot be written.
    """
    # Late: the page loads jinja2, which a wrong argument should not wait for.
    from wheelpend.reproduction.files import make_writable_folder, write_all

    if what not in REPRODUCTION_PARTS:
        raise Failure(
            f"No part of the paper is named '{what}'. Known parts: {', '.join(REPRODUCTION_PARTS)}."
            f"{did_you_mean(what, REPRODUCTION_PARTS)}"
        )
    if seeds < 1:
        raise Failure(f"--seeds must be at least 1, not {seeds}. Use 100 or more for a spread that can be trusted.")
    require("matplotlib", "plots", "Drawing the reproduced figures")
    make_writable_folder(Path(out))
    model = model or Model.default()
    wanted = [p for p in REPRODUCTION_PARTS[:-1] if what in (p, "all")]
    progress("preparing the kernels")
    robot = load_robot(model.text)
    noiseless, trials = compute(model.text, wanted, seeds, progress)
    result = assemble(Reproduction(what, seeds, EXPERIMENT_DURATION_S, robot=robot, trials=trials), wanted, noiseless)
    progress("drawing")
    return replace(result, written=write_all(result, out))


def compute(
    text: str, wanted: list[str], seeds: int, progress: Callable[[str], None]
) -> tuple[Noiseless, tuple[Trial, ...]]:
    """Noiseless results and the trials of all seeds, on all cores."""
    tasks = plan_tasks(text, wanted, seeds)
    jobs: list[Callable[[], Any]] = [partial(compute_noiseless, text, wanted), *(partial(run_task, t) for t in tasks)]

    def report(done: int, left: float) -> None:
        seed = min(done, len(tasks))
        progress(
            f"seed {seed} of {len(tasks)}, about {duration_text(left)} left" if 0 < seed < len(tasks) else "computing"
        )

    report(0, 0.0)
    noiseless, *found = run_all(jobs, report)
    return noiseless, tuple(trial for trials in found for trial in trials)


def compute_noiseless(text: str, wanted: list[str]) -> Noiseless:
    """Table 3, and the effects of the choices that need no noise."""
    robot = load_robot(text)
    parts = [choices.table3_effects(robot)] if "table3" in wanted else []
    parts += [choices.figure_effects(robot)] if "figures" in wanted else []
    return Noiseless(tables.table3(robot) if "table3" in wanted else (), tuple(parts))


def plan_tasks(text: str, wanted: list[str], seeds: int) -> list[Task]:
    """One task per seed, with its experiments and methods."""
    if wanted == ["table3"]:
        return []
    return [Task(text, seed, tuple(_work(wanted, seed))) for seed in range(seeds)]


def _work(wanted: list[str], seed: int) -> Iterator[tuple[Setup, tuple[str, ...]]]:
    tabled = [t for t in wanted if t in TABLE_METHODS]
    for command in commands_of(wanted):
        methods = [m for t in tabled for m in TABLE_METHODS[t].get(command, ())]
        methods += FILTERED_METHODS if tabled else ()
        methods += ["conditions"] if tabled and seed < CONDITION_SEED_COUNT else []
        methods += ["shooting_above"] if tabled and seed < choices.NOMINAL_ABOVE_SEED_COUNT else []
        methods += ["filtered_foh", "rmse"] if "figures" in wanted else []
        skipped = ("cramer_rao",) if seed >= CONDITION_SEED_COUNT else ()
        yield Setup(command), tuple(m for m in dict.fromkeys(methods) if m not in skipped)
        for setup in choices.SETUP_VARIANTS.values() if tabled and seed < choices.VARIANT_SEED_COUNT else ():
            yield setup(command), ("filtered_foh",)


def commands_of(wanted: list[str]) -> tuple[str, ...]:
    """Commands whose noisy experiments are needed."""
    return COMMAND_NAMES if "table2" in wanted or "figures" in wanted else ("simple",)


def assemble(result: Reproduction, wanted: list[str], noiseless: Noiseless) -> Reproduction:
    """The result with the wanted tables and the choices that matter to them."""
    robot, trials, parts = result.robot, result.trials, list(noiseless.effects)
    assert robot is not None
    result = replace(result, table3=noiseless.table3)
    if "table1" in wanted:
        result = replace(result, table1=_cells(trials, "table1"))
    if "table2" in wanted:
        result = replace(result, table2=_cells(trials, "table2"))
    if result.table1 or result.table2:
        commands = commands_of([w for w in wanted if w in TABLE_METHODS])
        result = replace(
            result,
            started_at_rest=tuple(cell for c in commands for cell in tables.cells(trials, c, ("filtered_rest",))),
            conditions=tables.conditions(trials),
            unstable_pole=unstable_pole(robot),
        )
        parts.insert(0, choices.tables12_effects(trials, commands))
    if "figures" in wanted:
        result = replace(result, predictions=tables.predictions(robot, trials))
    return replace(result, choices=choices.collect_choices(result.seeds, parts))


def _cells(trials: tuple[Trial, ...], table: str) -> tuple[Cell, ...]:
    return tuple(c for command, methods in TABLE_METHODS[table].items() for c in tables.cells(trials, command, methods))
