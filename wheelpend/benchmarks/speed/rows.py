"""The rows of the table: work, contender and goal; the choice among them, and their measurement."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from wheelpend.benchmarks.speed import filtering, fitting, processes, regression, simulation, workbench
from wheelpend.benchmarks.speed.record import Goal, Measured, NotMeasurableError, Row
from wheelpend.benchmarks.speed.setting import Setting
from wheelpend.errors import Failure
from wheelpend.isolation import import_configured

MIN_SPEEDUP, MAX_TIME_RATIO, MAX_SECONDS = partial(Goal, "at least"), partial(Goal, "at most"), partial(Goal, "within")


def all_rows() -> tuple[Row, ...]:
    """Every row of the table."""
    return (
        *simulation_rows(),
        *regression_rows(),
        *filtering_rows(),
        *fitting_rows(),
        *process_rows(),
        *browser_rows(),
    )


def simulation_rows() -> tuple[Row, ...]:
    """Closed loops, per step."""
    one, batch = "closed loop, one trajectory of 20 s", f"closed loop, {simulation.BATCH_SIZE} trajectories of 20 s"
    against_batch = MIN_SPEEDUP(9.5 if wide_vectors() else 7.0)
    peer, on_two_cores = simulation.against_peer, simulation.batch_on_two_cores
    return (
        Row("loop", one, "C", MIN_SPEEDUP(1.15), simulation.against_c, "step"),
        Row("batch", f"{batch}, one core", "C", against_batch, simulation.batch_against_c, "step"),
        Row("cores", f"{batch}, two cores", "one core", MIN_SPEEDUP(1.8), on_two_cores, "step"),
        Row("casadi", one, "CasADi", MIN_SPEEDUP(8), partial(peer, name="casadi"), "step"),
        Row("mujoco", one, "MuJoCo, cart-pole", MIN_SPEEDUP(70), partial(peer, name="mujoco"), "step"),
        Row("lambdify", one, "lambdify and NumPy", MIN_SPEEDUP(900), partial(peer, name="lambdify"), "step"),
    )


def regression_rows() -> tuple[Row, ...]:
    """Filtered regression per sample, recursive least squares per update."""
    gram, recursion = "filtered regression, 10⁷ samples", "recursive least squares, 7 parameters"
    return (
        Row("gram", gram, "C", MIN_SPEEDUP(1.8), regression.gram_against_c, "sample"),
        Row("reading", gram, "reading it", MIN_SPEEDUP(0.25), regression.gram_against_reading, "sample"),
        Row("scipy", gram, "SciPy's lfilter", MIN_SPEEDUP(35), regression.gram_against_scipy, "sample"),
        Row("recursion", recursion, "C", MIN_SPEEDUP(1.3), regression.recursion_against_c, "update"),
        Row("padasip", recursion, "padasip", MIN_SPEEDUP(200), regression.recursion_against_padasip, "update"),
    )


def filtering_rows() -> tuple[Row, ...]:
    """Passes of the filter-error method's filter, and its whole fit."""
    bare, linearised = "filter of 20 s with a random force", "the same with seven sensitivities"
    fit, simulation_in_c = "`identify` from 60 s", "one C simulation"
    passing, differentiating = filtering.filter_against_simulation, filtering.gradient_against_simulation
    return (
        Row("filter", bare, simulation_in_c, MAX_TIME_RATIO(8), passing),
        Row("filter-gradient", linearised, simulation_in_c, MAX_TIME_RATIO(25), differentiating),
        Row("filter-fit", fit, "by shooting", MAX_TIME_RATIO(10), filtering.filter_fit_against_shooting),
    )


def fitting_rows() -> tuple[Row, ...]:
    """Fit, sensitivities, search and diagnosis, each as a whole."""
    sensitivities, simulation_in_c = "sensitivities of 20 s to every effect", "one C simulation"
    search, diagnosis = "all single effects and pairs after one pass", "whole diagnosis of a 20 s log"
    searching, diagnosing = fitting.search_against_refits, fitting.diagnosis_against_pysindy
    explaining = fitting.explanation_against_diagnosis
    differentiating = fitting.sensitivities_against_simulation
    return (
        Row("fit", "shooting fit to 60 s", simulation_in_c, MAX_TIME_RATIO(40), fitting.fit_against_simulation),
        Row("sensitivities", sensitivities, simulation_in_c, MAX_TIME_RATIO(40), differentiating),
        Row("search", search, "refits from the data", MIN_SPEEDUP(2000), searching),
        Row("diagnosis", diagnosis, "one pysindy fit", MIN_SPEEDUP(8), diagnosing),
        Row("explanation", "`explain` of 20 s by two effects", "one diagnosis", MAX_TIME_RATIO(3), explaining),
    )


def process_rows() -> tuple[Row, ...]:
    """New processes from their start to their end."""
    again = "the second"
    return (
        Row("second-run", "second run of `wheelpend identify`", "first run", MAX_SECONDS(0.6), processes.second_run),
        Row("demo", "first `wheelpend demo`, nothing compiled", again, MAX_SECONDS(120), processes.first_demo),
        Row("assumption", "first `identify`, another assumption", again, MAX_SECONDS(20), processes.other_assumption),
        Row("encoder", "first `identify`, relative encoder", again, MAX_SECONDS(20), processes.other_encoder),
        Row("derivation", "derivation with 15 effects", "importing sympy", MAX_SECONDS(1.0), processes.derivation),
    )


def browser_rows() -> tuple[Row, ...]:
    """The workbench with an hour's log in a browser, in which its page takes at most MAX_PAGE_BYTES."""
    picture, zoom, shorter = "workbench, first picture of an hour at 1 kHz", "workbench, zoom into it", "of 20 s"
    return (
        Row("picture", picture, shorter, MAX_SECONDS(3.0), workbench.first_picture),
        Row("zoom", zoom, shorter, MAX_SECONDS(0.2), workbench.zoom),
    )


def wide_vectors() -> bool:
    """True if compiled loops use 512-bit vectors: asked of the compiler, which knows processor and settings."""

    njit = import_configured("numba").njit

    @njit("void(float64[::1], float64[::1])")
    def add(x, y):
        for i in range(x.size):
            y[i] += x[i]

    return any("zmm" in text for text in add.inspect_asm().values())


def select_rows(names: Sequence[str]) -> list[Row]:
    """Rows of these names, all of them where none is given; raises Failure for a name that is none."""
    rows = all_rows()
    known = [row.name for row in rows]
    if wrong := [name for name in names if name not in known]:
        raise Failure(f"A row must be one of {', '.join(known)}, not {', '.join(wrong)}.")
    return [row for row in rows if row.name in names or not names]


def measure(rows: Sequence[Row], setting: Setting, progress: Callable[[str], None]) -> list[Measured]:
    """Measure row by row; what cannot be measured here is noted with its reason."""
    found = []
    for number, row in enumerate(rows, 1):
        progress(f"[{number}/{len(rows)}] {row.work}, beside {row.reference}")
        try:
            found.append(Measured(row, row.measure(setting)))
        except NotMeasurableError as reason:
            found.append(Measured(row, None, str(reason)))
        progress(f"    {found[-1]}")
    return found
