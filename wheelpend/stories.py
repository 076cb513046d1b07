"""The two stories of docs/ on measured logs, told anew: python -m wheelpend.stories [--data FOLDER] [--out docs].

The logs are not ours and stay where they are; docs/emps.md and docs/robot.md say where a reader finds them.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import matplotlib
import numpy as np
import typer
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from wheelpend import kernels
from wheelpend.comparison import Comparison, compare
from wheelpend.console import failures, progress, write_text
from wheelpend.explanation import Explanation, explain
from wheelpend.failures import Failure
from wheelpend.identification import identify
from wheelpend.inspection import inspect_file
from wheelpend.inverse_dynamics import force_error, raw_sides
from wheelpend.logs import Log
from wheelpend.model import Model
from wheelpend.shooting import vector
from wheelpend.study import read_logs

ESTIMATION, PULSES, BALANCING = "emps/DATA_EMPS.mat", "emps/DATA_EMPS_PULSES.mat", "mini_segway/balancing.csv"
INK, QUIET, BEFORE, AFTER = "#243447", "#8a97a6", "#d1592a", "#1f6f8b"
LADDER = ("voltage_offset", "viscous_drive", "coulomb_drive", "viscous_asymmetry")  # as explain finds it
PUBLISHED = {"X1": 95.1089, "viscous_drive.coefficient": 203.5034, "coulomb_drive.torque": 20.3935,
             "voltage_offset.offset": 3.1648}  # Janot, Gautier, Brunot 2019: kg, N s/m, N, N  # fmt: skip

SLIDE = """\
plant = "slide"
effects = ["voltage_offset"]           # mass and offset alone: what friction there is, the tool is to find

[constants]
gain = 35.1507                         # force on the carriage per volt [N/V]

[columns]
x = { column = "qm" }
v_in = { column = "vir" }
x_ref = { column = "qg" }
"""

ROBOT = """\
plant = "wheel_pendulum"
effects = []

[sensors]
encoder = "relative"                   # the encoders sit in the motors
"""
HARD_FLOOR = """
[assumptions]
ground_friction = false                # hard tyres on a hard floor: all viscous friction is the drive's
"""

app = typer.Typer(add_completion=False)


@app.command()
def main(
    data: Annotated[Path | None, typer.Option(help="Folder of the logs; $WHEELPEND_DATA, or ../shared/data.")] = None,
    out: Annotated[Path, typer.Option(help="Folder of the pages and their pictures.")] = Path("docs"),
) -> None:
    """Write docs/emps.md and docs/robot.md with their pictures, from the measured logs."""
    folder = data or Path(os.environ.get("WHEELPEND_DATA", "../shared/data"))
    with failures(), progress("reading") as update:
        for name in (ESTIMATION, PULSES, BALANCING):
            if not (folder / name).exists():
                raise Failure(f"The logs must be in {folder}, but {name} is not there. See docs/emps.md and "
                              "docs/robot.md for where to find them.")  # fmt: skip
        out.mkdir(parents=True, exist_ok=True)
        write_text(out / "emps.md", emps(folder / ESTIMATION, folder / PULSES, out, update))
        write_text(out / "robot.md", robot(folder / BALANCING, out, update))


# ---- the slide


def emps(estimation: Path, pulses: Path, out: Path, update) -> str:
    """The page on the EMPS."""
    model = Model.parse(SLIDE)
    found = explain(model, [estimation], progress=update)
    update("inverse dynamics with each rung")
    rungs = [rung(model, effects, estimation, pulses) for effects in ladder_of(found)]
    final = found.model
    update("comparing with the log with pulses")
    values = rungs[-1][3]
    held = fitted_to(final, values)
    there = compare(held, [pulses])
    here = compare(held, [estimation])
    pulse_times = [b["from"] for b in there.bursts if not b["at_reversal"]]
    draw_ladder(out / "emps_ladder.svg", rungs)
    draw_force(out / "emps_force.svg", model, rungs, estimation)
    draw_bursts(out / "emps_pulses.svg", held, pulses, there)
    return EMPS.format(
        model=SLIDE,
        steps=table(("step", "added", "error before [σ]", "error after [σ]"), step_rows(found)),
        forces=table(
            ("model", "estimation [%]", "pulses [%]", "M [kg]", "F_v [N s/m]", "F_c [N]", "offset [N]"),
            [force_row(name, r) for name, r in zip(NAMES, rungs, strict=False)] + [PUBLISHED_ROW],
        ),
        worst=f"{worst(rungs[2][3]):.2f}",
        asymmetry=f"{rungs[-1][3]['viscous_asymmetry.coefficient'] * GAIN:.1f}",
        shooting=table(("", "M [kg]", "F_v [N s/m]", "F_c [N]"), shooting_rows(model, estimation, pulses)),
        verdict=found.verdict,
        repeats=repeated(found),
        bursts=len(pulse_times),
        edges=", ".join(f"{t:.3f}" for t in pulse_times[:8]),
        peak=f"{max(b['peak'] for b in there.bursts) * GAIN:.0f}",
        quiet=sum(not b["at_reversal"] for b in here.bursts),
        turning=sum(b["at_reversal"] for b in here.bursts),
    )


GAIN = 35.1507
NAMES = ("mass and offset", "+ viscous_drive", "+ coulomb_drive", "+ viscous_asymmetry")
PUBLISHED_ROW = ("published, with Coulomb friction", "4.083", "5.982", "95.11", "203.50", "20.39", "3.16")
Rung = tuple[tuple[str, ...], float, float, dict[str, float]]


def ladder_of(found: Explanation) -> list[tuple[str, ...]]:
    """The effects of every rung, from those of the model on."""
    own = tuple(found.effects[: len(found.effects) - len(found.steps)])
    return [own + tuple(s.effect for s in found.steps[:k]) for k in range(len(found.steps) + 1)]


def rung(model: Model, effects: Sequence[str], estimation: Path, pulses: Path) -> Rung:
    """A model by inverse dynamics on the estimation log: its force error there and on the other, and its values."""
    larger = model.with_effects(effects)
    found = identify(larger, [estimation], method="inverse")
    values = {n: row["value"] for n, row in found.parameters.items()}
    other = force_error(kernels.lean(larger.plant, larger.assumptions, effects), read_logs([pulses], larger)[0], values)
    return tuple(effects), found.force_error or float("nan"), other or float("nan"), values


def force_row(name: str, one: Rung) -> tuple[str, ...]:
    """A rung as a row of the table."""
    values = [one[3].get(n) for n in PUBLISHED]
    return (name, f"{one[1]:.2f}", f"{one[2]:.2f}", *("–" if v is None else f"{v * GAIN:.2f}" for v in values))


def worst(values: dict[str, float]) -> float:
    """Largest difference from a published parameter [%]."""
    return max(abs(100.0 * (values[n] * GAIN / published - 1.0)) for n, published in PUBLISHED.items())


def shooting_rows(model: Model, *logs: Path) -> list[tuple[str, ...]]:
    """Parameters of the model with viscous and Coulomb friction by shooting on each log."""
    larger, rows = model.with_effects(LADDER[:3]), []
    for path in logs:
        found = identify(larger, [path]).parameters
        cells = [f"{found[n]['value'] * GAIN:.2f} ± {found[n]['sigma'] * GAIN:.2f}" for n in [*PUBLISHED][:3]]
        rows.append((path.name, *cells))
    return rows


def repeated(found: Explanation) -> str:
    """How much of what is left repeats, in words."""
    if not found.repeats:
        return "nothing"
    one = found.repeats[0]
    return f"{100 * one.repeatable:.0f} %, with {' and '.join(one.depends_on)}"


def fitted_to(model: Model, values: dict[str, float]) -> Model:
    """A model with these values as identified."""
    return model.with_fit({n: (v, None) for n, v in values.items()})


# ---- the robot


def robot(path: Path, out: Path, update) -> str:
    """The page on the balancing robot."""
    model = Model.parse(ROBOT)
    log, looked = inspect_file(model, path)
    found = explain(model, [path], progress=update)
    with_dry = Model.parse(ROBOT + HARD_FLOOR).with_effects(["coulomb_drive"])
    update("fitting all of the log with dry friction")
    whole = identify(with_dry, [path])
    judged = compare(whole.model, [path])
    drive = next(n for n in whole.parameters if whole.unit[n] == "V s/rad" and "." not in n)
    still = looked.stand_still.get("theta_w", [])
    draw_robot(out / "robot_stands.svg", log, still)
    draw_steps(out / "robot_ladder.svg", found)
    total = sum(b - a for a, b in still)
    first = found.steps[0]
    return ROBOT_PAGE.format(
        model=ROBOT,
        channels=table(
            ("channel", "least", "greatest", "noise"),
            [(c, *(f"{row[k]:.4g}" for k in ("minimum", "maximum", "noise"))) for c, row in looked.channels.items()],
        ),
        jitter=f"{100 * looked.jitter:.1f}",
        steps=table(("step", "added", "error before [σ]", "error after [σ]"), step_rows(found)),
        first=first.effect,
        size=f"{first.coefficients.get('torque', float('nan')):.3f}",
        cut=f"{100 * (1 - first.error_after / first.error_before):.0f}",
        base=f"{found.base_error:.2f}",
        error=f"{found.error:.2f}",
        verdict=found.verdict,
        k=f"{whole.parameters[drive]['value']:.2f} ± {whole.parameters[drive]['sigma']:.2f}",
        torque=f"{whole.parameters['coulomb_drive.torque']['value']:.3f}",
        still=f"{total:.2f}",
        duration=f"{log.duration:.1f}",
        stretches="; ".join(f"{a:.2f}–{b:.2f}" for a, b in still),
        where="\n".join(f"- {p.row} row: {100 * p.share:.0f} % of the missing force lies where {p.state} is between "
                        f"{p.low:.3g} and {p.high:.3g}" for p in judged.where),
    )  # fmt: skip


# ---- tables and pictures


def table(header: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A Markdown table."""
    lines = ["| " + " | ".join(map(str, row)) + " |" for row in (header, ["---"] * len(header), *rows)]
    return "\n".join(lines)


def step_rows(found: Explanation) -> list[tuple[str, ...]]:
    """The steps of an explanation."""
    return [(str(k), s.effect, f"{s.error_before:.4g}", f"{s.error_after:.4g}") for k, s in enumerate(found.steps, 1)]


def picture(width: float, height: float, rows: int = 1):
    """A figure with axes in the project's colours."""
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.subplots(rows, 1, squeeze=False, sharex=rows > 1)[:, 0]
    for ax in axes:
        ax.spines[["top", "right"]].set_visible(False)
        ax.tick_params(colors=INK)
    return figure, axes


def saved(figure, path: Path) -> None:
    """Write an SVG that is the same for the same numbers."""
    with matplotlib.rc_context({"svg.hashsalt": path.name}):
        figure.savefig(path, metadata={"Date": None})


def draw_ladder(path: Path, rungs: Sequence[Rung]) -> None:
    """Force error of every rung on both logs."""
    figure, (ax,) = picture(7, 2.6)
    y = np.arange(len(rungs))[::-1]
    ax.barh(y + 0.18, [r[1] for r in rungs], 0.34, color=AFTER, label="estimation log")
    ax.barh(y - 0.18, [r[2] for r in rungs], 0.34, color=BEFORE, label="log with pulses")
    ax.set_yticks(y, NAMES[: len(rungs)])
    ax.set_xscale("log")
    ax.set_xticks([3, 5, 10, 20, 50], ["3", "5", "10", "20", "50"])
    ax.xaxis.set_minor_locator(NullLocator())
    ax.set_xlabel("force error [%]")
    ax.legend(frameon=False)
    saved(figure, path)


def draw_force(path: Path, model: Model, rungs: Sequence[Rung], log_path: Path) -> None:
    """Measured force and what the equations leave of it, rung by rung, over five seconds."""
    figure, axes = picture(7, 5.2, len(rungs))
    for ax, name, (effects, *_, values) in zip(axes, NAMES, rungs, strict=False):
        t, force, rest = left_over(model.with_effects(effects), values, log_path)
        shown = (t > 1.0) & (t < 6.0)
        ax.plot(t[shown], force[shown], color=QUIET, lw=0.8, label="measured force")
        ax.plot(t[shown], rest[shown], color=BEFORE, lw=0.9, label="left unexplained")
        ax.set_title(name, fontsize=9, loc="left", color=INK)
        ax.set_ylabel("N")
    axes[0].legend(frameon=False, ncols=2, fontsize=8, loc="upper right")
    axes[-1].set_xlabel("time [s]")
    saved(figure, path)


def draw_bursts(path: Path, model: Model, log_path: Path, judged: Comparison) -> None:
    """What the equations leave of the force in the log with pulses, with the bursts marked."""
    figure, (ax,) = picture(7, 2.6)
    values = {n: v for n in (*model.parameters, *model.effect_values) if (v := model.value(n)) is not None}
    t, _, rest = left_over(model, values, log_path)
    shown = (t > 1.0) & (t < 6.0)
    ax.plot(t[shown], rest[shown], color=INK, lw=0.6)
    for burst in judged.bursts:
        if 1.0 < burst["from"] < 6.0:
            ax.axvspan(burst["from"], burst["to"], color=QUIET if burst["at_reversal"] else BEFORE, alpha=0.5)
    ax.set_ylabel("left unexplained [N]")
    ax.set_xlabel("time [s]; orange: bursts, grey: bursts at a reversal")
    saved(figure, path)


def left_over(model: Model, values: dict[str, float], log_path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, force and what the equations leave of it [N], at the bandwidth of the differentiated motion."""
    module = kernels.lean(model.plant, model.assumptions, model.effects)
    log = read_logs([log_path], model)[0]
    raw = raw_sides(module, log, vector(module, values, log))
    assert raw is not None, "the log is one long stretch"
    rest = raw.left - raw.regressor @ np.array([values[n] for n in module.LINEAR])
    return raw.t, GAIN * raw.left[:, 0], GAIN * rest[:, 0]


def draw_robot(path: Path, log: Log, still: Sequence[tuple[float, float]]) -> None:
    """Drive angle, pitch and voltage, with the stretches marked in which the drive stands."""
    figure, axes = picture(7, 4.6, 3)
    rows = (
        ("drive angle [rad]", log.measured[:, 0]),
        ("pitch [rad]", log.measured[:, 1]),
        ("voltage [V]", log.voltage),
    )
    for ax, (name, signal) in zip(axes, rows, strict=True):
        ax.plot(log.t, signal, color=INK, lw=0.9)
        ax.set_ylabel(name)
        for a, b in still:
            ax.axvspan(a, b, color=BEFORE, alpha=0.25, lw=0)
    axes[-1].set_xlabel("time [s]; marked: the drive stands still")
    saved(figure, path)


def draw_steps(path: Path, found: Explanation) -> None:
    """The error ladder."""
    figure, (ax,) = picture(7, 1.2 + 0.4 * len(found.steps))
    names = ["parameters refitted", *(f"+ {s.effect}" for s in found.steps)]
    errors = [found.base_error, *(s.error_after for s in found.steps)]
    y = np.arange(len(names))[::-1]
    ax.barh(y, errors, color=[BEFORE, *[AFTER] * len(found.steps)])
    ax.axvline(found.noise_floor, color=QUIET, lw=1, ls="--")
    ax.set_yticks(y, names)
    ax.set_xlabel("held-out error [σ]; dashed: noise floor")
    saved(figure, path)


# ---- words

EMPS = """\
# A machine axis: from mass and offset to direction-dependent friction

*This page is written by `python -m wheelpend.stories`; the figures in it are what that command measured.*

The EMPS is a DC motor that drives a carriage along a ball screw (Janot, Gautier, Brunot, *Data Set and Reference Models
of EMPS*, Nonlinear System Identification Benchmarks, 2019; the two logs are on nonlinearbenchmark.org). The motor's
command `vir` is a force on the carriage, 35.15 N per volt. One encoder reads the carriage's place. The plant is
[`slide`](plants.md); the logs are MATLAB files and are read as they are.

```toml
{model}```

```sh
wheelpend explain DATA_EMPS.mat
```

## Which effects are missing

{steps}

The tool starts from mass and offset, and names viscous friction, then Coulomb friction, then what the data still hold:
friction that is larger one way than the other. The errors are in units of the encoder's noise, some 40 nm, over half a
second: the model is judged far more sharply here than by its force. The verdict on what is left is `{verdict}`: of it
repeats {repeats}.

## What it costs in force

With the values of `wheelpend identify --method inverse` on the estimation log (inverse dynamics: positions filtered
forth and back at 100 Hz, both sides below 50 Hz, thinned by ten), of the measured force there is left

{forces}

![Force error of every model](emps_ladder.svg)
![What each model leaves of the force](emps_force.svg)

With Coulomb friction the parameters are within {worst} % of the published ones. Half the difference between the two
directions is {asymmetry} N s/m (published: 166.7 and 240.4, that is -36.9). Without Coulomb friction the viscous
coefficient comes out twice as large: a missing effect corrupts the others.

Shooting, which lets nothing but the initial states of half-second segments go, finds nearly the same on either log. The
pulses are not absorbed into friction:

{shooting}

## The force pulses

In the second log somebody pushed the carriage with force pulses of half a second. With the values from the first log,
`wheelpend compare DATA_EMPS_PULSES.mat` names {bursts} short stretches in which the equations miss far more force than
usual, up to {peak} N: at t = {edges}, … s,
at the edges of the pulses. In the first log it names {quiet} such stretches, and {turning} at reversals. Each is a ring
of some 10 ms: the authors suspect a flexibility, which the model does not have; it is reported, not absorbed.

![Bursts in the log with pulses](emps_pulses.svg)

## What to keep in mind

The input is taken as it stands at the sample, as the published method does. The command is held until the next sample;
with its mean over the interval the force error falls to 3.95 % and 4.04 %, and F_v rises by 2 %. Which is right the
data do not say: it is half a millisecond of delay.
"""

ROBOT_PAGE = """\
# A balancing robot: a gearbox that sticks

*This page is written by `python -m wheelpend.stories`; the figures in it are what that command measured.*

The log is the balancing part of LOG278.TXT of the public repository pichim/Mini_Segway (14.05 to 20.15 s), in this
project's columns: the mean of both motors' voltages, the mean of both encoders, which sit in the motors and so measure
against the body, the pitch of a Mahony filter, and a gyro. The author publishes k = 0.546 V s/rad at the wheel, and
no friction but viscous.

```toml
{model}```

```sh
wheelpend inspect balancing.csv
wheelpend explain balancing.csv
```

## The log

{channels}

The clock jitters by {jitter} % of an interval. Nothing is said of the sensors in the model: their noise is found from
the log. In {still} of {duration} s the drive stands still, within the noise of its encoders, while voltage and pitch
move: at t = {stretches} s.

![The drive stands still in the marked stretches](robot_stands.svg)

## What is missing

{steps}

![The error ladder](robot_ladder.svg)

`{first}` is named first: {size} V are spent before the gearbox moves at all. That cuts the held-out error by {cut} %;
from {base} after a refit of the parameters alone it comes to {error} in the end.

On hard tyres and a hard floor, all viscous friction is the drive's:

```toml
[assumptions]
ground_friction = false
```

With that and dry friction in the model, the whole log gives k = {k} V s/rad, and dry friction of {torque} V.

## What remains

The verdict is `{verdict}`: the pitch comes from a filter, the gears have play, and something gives. The tool does not
name them on these six seconds. What is left shows

{where}

The inertias are hardly excited: the robot catches itself once and then wanders, so that single ones of X1 to X5 are
known within a factor at best. A log with a driven command would tell them.
"""

if __name__ == "__main__":
    app()
