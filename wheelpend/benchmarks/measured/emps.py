"""The story of the measured machine axis (EMPS), from mass and offset to direction-dependent friction."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from wheelpend.api import explain
from wheelpend.benchmarks.measured.drawing import (
    FORCE_PER_VOLT_N,
    RUNG_LABELS,
    Rung,
    draw_bursts,
    draw_force,
    draw_force_ladder,
    markdown_table,
    step_rows,
)
from wheelpend.diagnosis.compare import compare
from wheelpend.diagnosis.explain import Explanation
from wheelpend.estimation.data import read_logs
from wheelpend.identification.identify import identify
from wheelpend.identification.inverse_dynamics import force_error
from wheelpend.kernels import load as kernels
from wheelpend.model.record import Model

ESTIMATION_LOG, PULSES_LOG, BALANCING_LOG = (
    "emps/DATA_EMPS.mat",
    "emps/DATA_EMPS_PULSES.mat",
    "mini_segway/balancing.csv",
)
FRICTION_EFFECTS = ("voltage_offset", "viscous_drive", "coulomb_drive", "viscous_asymmetry")  # as explain finds it
PUBLISHED_FORCE_VALUES = {"X1": 95.1089, "viscous_drive.coefficient": 203.5034, "coulomb_drive.torque": 20.3935,
             "voltage_offset.offset": 3.1648}  # Janot, Gautier, Brunot 2019: kg, N s/m, N, N  # fmt: skip
SLIDE_MODEL = """\
plant = "slide"
effects = ["voltage_offset"]           # mass and offset alone: what friction there is, the tool is to find

[constants]
gain = 35.1507                         # force on the carriage per volt [N/V]

[columns]
x = { column = "qm" }
v_in = { column = "vir" }
x_ref = { column = "qg" }
"""


def emps_page_text(estimation: Path, pulses: Path, out: Path, update) -> str:
    """The page on the EMPS."""
    model = Model.parse(SLIDE_MODEL)
    found = explain(model, [estimation], progress=update)
    update("inverse dynamics with each rung")
    rungs = [fit_rung(model, effects, estimation, pulses) for effects in effects_of_rungs(found)]
    final = found.model
    update("comparing with the log with pulses")
    values = rungs[-1][3]
    held = model_with_values(final, values)
    there = compare(held, [pulses])
    here = compare(held, [estimation])
    pulse_times = [b["from"] for b in there.bursts if not b["at_reversal"]]
    draw_force_ladder(out / "emps_ladder.svg", rungs)
    draw_force(out / "emps_force.svg", model, rungs, estimation)
    draw_bursts(out / "emps_pulses.svg", held, pulses, there)
    return EMPS_PAGE.format(
        model=SLIDE_MODEL,
        steps=markdown_table(("step", "added", "error before [σ]", "error after [σ]"), step_rows(found)),
        forces=markdown_table(
            ("model", "estimation [%]", "pulses [%]", "M [kg]", "F_v [N s/m]", "F_c [N]", "offset [N]"),
            [force_row(name, r) for name, r in zip(RUNG_LABELS, rungs, strict=False)] + [PUBLISHED_ROW],
        ),
        worst=f"{max_deviation_percent(rungs[2][3]):.2f}",
        asymmetry=f"{rungs[-1][3]['viscous_asymmetry.coefficient'] * FORCE_PER_VOLT_N:.1f}",
        shooting=markdown_table(("", "M [kg]", "F_v [N s/m]", "F_c [N]"), shooting_rows(model, estimation, pulses)),
        verdict=found.verdict,
        repeats=repeatable_share_text(found),
        bursts=len(pulse_times),
        edges=", ".join(f"{t:.3f}" for t in pulse_times[:8]),
        peak=f"{max(b['peak'] for b in there.bursts) * FORCE_PER_VOLT_N:.0f}",
        quiet=sum(not b["at_reversal"] for b in here.bursts),
        turning=sum(b["at_reversal"] for b in here.bursts),
    )


PUBLISHED_ROW = ("published, with Coulomb friction", "4.083", "5.982", "95.11", "203.50", "20.39", "3.16")


def effects_of_rungs(found: Explanation) -> list[tuple[str, ...]]:
    """The effects of every rung, from those of the model on."""
    own = tuple(found.effects[: len(found.effects) - len(found.steps)])
    return [own + tuple(s.effect for s in found.steps[:k]) for k in range(len(found.steps) + 1)]


def fit_rung(model: Model, effects: Sequence[str], estimation: Path, pulses: Path) -> Rung:
    """A model by inverse dynamics on the estimation log: its force error there and on the other, and its values."""
    larger = model.with_effects(effects)
    found = identify(larger, [estimation], method="inverse")
    values = {n: row["value"] for n, row in found.parameters.items()}
    other = force_error(
        kernels.model_module(larger.plant, larger.assumptions, effects), read_logs([pulses], larger)[0], values
    )
    return tuple(effects), found.force_error or float("nan"), other or float("nan"), values


def force_row(name: str, one: Rung) -> tuple[str, ...]:
    """A rung as a row of the table."""
    values = [one[3].get(n) for n in PUBLISHED_FORCE_VALUES]
    return (
        name,
        f"{one[1]:.2f}",
        f"{one[2]:.2f}",
        *("–" if v is None else f"{v * FORCE_PER_VOLT_N:.2f}" for v in values),
    )


def max_deviation_percent(values: dict[str, float]) -> float:
    """Largest difference from a published parameter [%]."""
    return max(
        abs(100.0 * (values[n] * FORCE_PER_VOLT_N / published - 1.0)) for n, published in PUBLISHED_FORCE_VALUES.items()
    )


def shooting_rows(model: Model, *logs: Path) -> list[tuple[str, ...]]:
    """Parameters of the model with viscous and Coulomb friction by shooting on each log."""
    larger, rows = model.with_effects(FRICTION_EFFECTS[:3]), []
    for path in logs:
        found = identify(larger, [path]).parameters
        cells = [
            f"{found[n]['value'] * FORCE_PER_VOLT_N:.2f} ± {found[n]['sigma'] * FORCE_PER_VOLT_N:.2f}"
            for n in [*PUBLISHED_FORCE_VALUES][:3]
        ]
        rows.append((path.name, *cells))
    return rows


def repeatable_share_text(found: Explanation) -> str:
    """How much of what is left repeats, in words."""
    if not found.repeats:
        return "nothing"
    one = found.repeats[0]
    return f"{100 * one.repeatable:.0f} %, with {' and '.join(one.depends_on)}"


def model_with_values(model: Model, values: dict[str, float]) -> Model:
    """A model with these values as identified."""
    return model.with_fit({n: (v, None) for n, v in values.items()})


EMPS_PAGE = """\
# A machine axis: from mass and offset to direction-dependent friction

*This page is written by `python -m wheelpend.benchmarks.measured`; the figures in it are what that command measured.*

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
