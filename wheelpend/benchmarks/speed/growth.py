"""``python -m wheelpend.benchmarks.speed.growth``: how time and memory grow with the log, the effects and the batch.

Each figure is measured in a process of its own, so that its peak of memory is that of this work. What the log itself
takes is there before, and is not counted.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from time import perf_counter
from typing import Annotated, NamedTuple

import numpy as np
import typer

from wheelpend.files import write_text
from wheelpend.parallel import BLAS_THREAD_VARIABLES
from wheelpend.reports.console import exit_on_failure, print_line

BEGIN_MARK, END_MARK = "<!-- written by wheelpend.benchmarks.speed.growth -->", "<!-- end of growth -->"
WARM_UP_SAMPLES = 20_000  # samples on which a work is done once before it is measured
LOG_SAMPLE_COUNTS = (1_000, 10_000, 100_000, 1_000_000, 10_000_000)
DIAGNOSIS_SAMPLE_COUNTS = (10_000, 30_000, 100_000)
EFFECT_COUNTS = (5, 10, 20, 30, 50)  # the library's that last and free nothing, then up to twenty of a user's own
BATCH_SIZES = (1, 10, 100, 1_000, 10_000)


class ScalingPoint(NamedTuple):
    """One figure."""

    size: int
    seconds: float
    megabytes: float  # peak beyond what was there before


class ScalingCurve(NamedTuple):
    """A kind of work over its sizes."""

    name: str
    over: str
    found: tuple[ScalingPoint, ...]

    def exponent(self, of: str) -> float:
        """Slope of the upper half, in logarithms; what is not seen beside the fixed cost has none."""
        rows = [(g.size, getattr(g, of)) for g in self.found if getattr(g, of) > 0.0][-3:]
        sizes, values = np.log(np.array(rows, dtype=float)).T
        return float(np.polyfit(sizes, values, 1)[0])


def main(
    out: Annotated[Path, typer.Option(help="Page whose marked place gets the figures.")] = Path("docs/performance.md"),
    longest: Annotated[int, typer.Option(help="Samples of the longest log.")] = LOG_SAMPLE_COUNTS[-1],
    one: Annotated[str, typer.Option(hidden=True)] = "",
) -> None:
    """Measure growth and write it into a page, with a picture."""
    if one:
        kind, number, place = one.split(":")
        print(json.dumps(measure_once(kind, int(number), Path(place))))
        return
    with exit_on_failure(), tempfile.TemporaryDirectory() as folder:
        lengths = [n for n in LOG_SAMPLE_COUNTS if n <= longest]
        write_log(Path(folder), lengths[-1])
        found = []
        for kind, over, sizes in (
            ("identify", "samples", lengths),
            ("identify --method filtered", "samples", lengths),
            ("diagnose", "samples", DIAGNOSIS_SAMPLE_COUNTS),
            ("diagnose", "effects", EFFECT_COUNTS),
            ("closed_loop_batch", "machines", BATCH_SIZES),
        ):
            rows = []
            for size in sizes:
                label = f"{kind} of {over}:{size}:{folder}"
                print(f"{kind}, {size:,} {over}", file=sys.stderr)
                rows.append(ScalingPoint(*measure_in_process(label)))
            found.append(ScalingCurve(kind, over, tuple(rows)))
            write(out, found)
        print_line(markdown_table(found))


def measure_in_process(label: str) -> tuple[int, float, float]:
    """A figure from a process of its own."""
    environment = {**os.environ, **dict.fromkeys(BLAS_THREAD_VARIABLES, "1")}
    run = subprocess.run(
        [sys.executable, "-m", "wheelpend.benchmarks.speed.growth", "--one", label],
        env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if run.returncode:
        raise SystemExit(run.stderr)
    size, seconds, megabytes = json.loads(run.stdout.splitlines()[-1])
    return int(size), float(seconds), float(megabytes)


def write_log(folder: Path, samples: int) -> None:
    """A long log of the paper's robot, as arrays on disk."""
    from wheelpend.model.record import Model
    from wheelpend.simulation.simulate import SAMPLE_INTERVAL_S, simulate

    log = simulate(Model.default(), duration=(samples - 1) * SAMPLE_INTERVAL_S, seed=1)
    for name in ("t", "voltage", "measured"):
        getattr(log, name).tofile(folder / name)


def measure_once(kind: str, size: int, folder: Path) -> tuple[int, float, float]:
    """Do a work once to have everything loaded, then measure it."""
    prepared, work = WORK_FACTORIES[kind](size, folder)
    prepared()
    before = peak_memory_mb()
    begin = perf_counter()
    work()
    return size, perf_counter() - begin, peak_memory_mb() - before


def peak_memory_mb() -> float:
    """The most memory that this process has had [MB]."""
    line = next(x for x in Path("/proc/self/status").read_text().splitlines() if x.startswith("VmHWM"))
    return float(line.split()[1]) / 1024.0  # getrusage would count what the parent process had


def read_log(folder: Path, samples: int):
    """The first samples of the long log."""
    from wheelpend.logs.log import Log

    t, voltage = (np.fromfile(folder / name, count=samples) for name in ("t", "voltage"))
    measured = np.fromfile(folder / "measured", count=3 * samples).reshape(-1, 3)
    return Log("long", t, voltage, measured, channels=("theta_w", "theta_p", "dtheta_p"))


def identification(method: str, size: int, folder: Path) -> tuple[Callable, Callable]:
    """Identify the paper's model from so many samples."""
    from wheelpend import Model, identify

    model, log = Model.default(), read_log(folder, size)

    def run(samples: int) -> None:
        identify(model, [log.part(0, samples)], method=method, test_bias=False)

    return lambda: run(min(size, WARM_UP_SAMPLES)), lambda: run(size)


def diagnosis(size: int, folder: Path) -> tuple[Callable, Callable]:
    """Diagnose from so many samples."""
    from wheelpend import Model, diagnose

    model, log = Model.default(), read_log(folder, size)
    return lambda: diagnose(model, [log.part(0, min(size, WARM_UP_SAMPLES))]), lambda: diagnose(model, [log])


def diagnosis_of_effects(size: int, folder: Path) -> tuple[Callable, Callable]:
    """Diagnose 20 s with so many effects to choose from; beyond the library's there are drags of further powers."""
    from wheelpend import Model, diagnose
    from wheelpend.model import workspace
    from wheelpend.simulation.simulate import simulate

    place = folder / f"effects_{size}"
    model = workspace.create(place, "wheel_pendulum")
    known = [e.name for e in library() if not e.event and not e.releases]
    if size > len(known):
        rows = [USER_EFFECT_TEMPLATE.format(number=n, power=2 + n) for n in range(size - len(known))]
        (place / "effects.toml").write_text("\n".join(rows), encoding="utf-8")
        model = Model.open(place)
    left_out = [e.name for e in library() if e.name not in known[:size]]
    log = simulate(Model.default(), duration=20.0, hide={"coulomb_drive": 0.3}, seed=1)

    def run() -> None:
        diagnose(model, [log], without=[n for n in left_out if n != "coulomb_drive"])

    return run, run


USER_EFFECT_TEMPLATE = """[drag_{number}]
family = "drive"
sentence = "A drag that grows with a power of the speed."
on = "drive"
law = "size*speed*abs(speed/20)^{power}"
[drag_{number}.parameters]
size = {{ unit = "V s/rad", typical = 0.1 }}
"""


def library():
    """The library's effects on the paper's plant."""
    import derive

    return derive.effects.applicable_to(
        derive.plants.build("wheel_pendulum", derive.plants.complete_assumptions("wheel_pendulum", {}))
    )


def batch(size: int, folder: Path) -> tuple[Callable, Callable]:
    """So many closed loops of 2 s side by side."""
    from pathlib import Path as Folder

    from wheelpend.benchmarks.speed.setting import Setting

    setting = Setting(Folder())
    loop, module = setting.loop(2.0), setting.lean
    many, record = np.ones((size, 1)), np.zeros((len(loop.t) // 100 + 1, module.NX + 1, size))

    def run(count: int) -> None:
        module.closed_loop_batch(
            loop.t, loop.reference, loop.rate, many[:count] * loop.gains, many[:count] * loop.state,
            many[:count] * loop.parameters, 1e-3, 100, record[:, :, :count].copy(),
        )  # fmt: skip

    return lambda: run(1), lambda: run(size)


WORK_FACTORIES: dict[str, Callable[[int, Path], tuple[Callable, Callable]]] = {
    "identify of samples": lambda n, f: identification("shooting", n, f),
    "identify --method filtered of samples": lambda n, f: identification("filtered", n, f),
    "diagnose of samples": diagnosis,
    "diagnose of effects": diagnosis_of_effects,
    "closed_loop_batch of machines": batch,
}


def markdown_table(found: Sequence[ScalingCurve]) -> str:
    """The figures in Markdown."""
    lines = [
        "| work | grows with | sizes | time [s] | its exponent | memory beyond the input [MB] |",
        "|---|---|---|---|---|---|",
    ]
    for g in found:
        sizes, seconds, memory = (
            ", ".join(form.format(x) for x in column)
            for form, column in zip(("{:,}", "{:.3g}", "{:.0f}"), zip(*g.found, strict=True), strict=True)
        )
        lines.append(f"| `{g.name}` | {g.over} | {sizes} | {seconds} | {g.exponent('seconds'):.2f} | {memory} |")
    return "\n".join(lines)


def write(path: Path, found: Sequence[ScalingCurve]) -> None:
    """Write the table between its marks, and the picture beside the page."""
    draw(path.parent / "performance_growth.svg", found)
    before = path.read_text(encoding="utf-8") if path.exists() else f"{BEGIN_MARK}\n{END_MARK}\n"
    head, _, rest = before.partition(BEGIN_MARK)
    picture = "![Time and memory over the size of the work](performance_growth.svg)"
    write_text(
        path, f"{head}{BEGIN_MARK}\n\n{markdown_table(found)}\n\n{picture}\n\n{END_MARK}{rest.partition(END_MARK)[2]}"
    )


def draw(path: Path, found: Sequence[ScalingCurve]) -> None:
    """Time and memory over size, in logarithms, one panel for each thing that grows."""
    import matplotlib
    from matplotlib.figure import Figure

    kinds = list(dict.fromkeys(g.over for g in found))
    figure = Figure(figsize=(10.0, 6.0), layout="constrained")
    panels = figure.subplots(2, len(kinds), squeeze=False)
    for row, (of, label) in zip(
        panels, (("seconds", "time [s]"), ("megabytes", "memory beyond the input [MB]")), strict=True
    ):
        for axes, over in zip(row, kinds, strict=True):
            draw_panel(axes, [g for g in found if g.over == over], of)
            axes.set_xlabel(over)
            axes.set_ylabel(label)
    path.parent.mkdir(parents=True, exist_ok=True)
    with matplotlib.rc_context({"svg.hashsalt": path.name}):
        figure.savefig(path, metadata={"Date": None})


def draw_panel(axes, found: Sequence[ScalingCurve], of: str) -> None:
    """One panel; less than a megabyte is drawn as one."""
    least = 1.0 if of == "megabytes" else 0.0
    for number, g in enumerate(found):
        sizes, values = [x.size for x in g.found], [max(getattr(x, of), least) for x in g.found]
        exponent = g.exponent(of) if of == "seconds" or min(values[-2:]) > least else 0.0
        axes.loglog(sizes, values, "o-", color=f"C{number}", label=f"{g.name}: exponent {exponent:.2f}")
    shown = sorted({x.size for g in found for x in g.found})
    axes.set_xticks(shown, [tick_label(x) for x in shown])
    axes.minorticks_off()
    low, high = axes.get_ylim()
    axes.set_ylim(0.3 * low, 20.0 * high)  # room for the names
    axes.legend(fontsize=7)
    axes.grid(alpha=0.3)


def tick_label(size: int) -> str:
    """A size as it stands on the axis: long ones only where they are powers of ten."""
    power = len(str(size)) - 1
    return str(size) if size < 1000 else f"$10^{power}$" if size == 10**power else ""


if __name__ == "__main__":
    typer.run(main)
