"""The story of the measured balancing robot: a gearbox that sticks."""

from __future__ import annotations

from pathlib import Path

from wheelpend.api import explain
from wheelpend.benchmarks.measured.drawing import draw_error_ladder, draw_robot, markdown_table, step_rows
from wheelpend.diagnosis.compare import compare
from wheelpend.identification.identify import identify
from wheelpend.inspection.inspect import inspect_file
from wheelpend.model.record import Model

ROBOT_MODEL = """\
plant = "wheel_pendulum"
effects = []

[sensors]
encoder = "relative"                   # the encoders sit in the motors
"""
HARD_FLOOR = """
[assumptions]
ground_friction = false                # hard tyres on a hard floor: all viscous friction is the drive's
"""


def robot_page_text(path: Path, out: Path, update) -> str:
    """The page on the balancing robot."""
    model = Model.parse(ROBOT_MODEL)
    log, looked = inspect_file(model, path)
    found = explain(model, [path], progress=update)
    with_dry = Model.parse(ROBOT_MODEL + HARD_FLOOR).with_effects(["coulomb_drive"])
    update("fitting all of the log with dry friction")
    whole = identify(with_dry, [path])
    judged = compare(whole.model, [path])
    drive = next(n for n in whole.parameters if whole.unit[n] == "V s/rad" and "." not in n)
    still = looked.stand_still.get("theta_w", [])
    draw_robot(out / "robot_stands.svg", log, still)
    draw_error_ladder(out / "robot_ladder.svg", found)
    total = sum(b - a for a, b in still)
    first = found.steps[0]
    return ROBOT_PAGE.format(
        model=ROBOT_MODEL,
        channels=markdown_table(
            ("channel", "least", "greatest", "noise"),
            [(c, *(f"{row[k]:.4g}" for k in ("minimum", "maximum", "noise"))) for c, row in looked.channels.items()],
        ),
        jitter=f"{100 * looked.jitter:.1f}",
        steps=markdown_table(("step", "added", "error before [σ]", "error after [σ]"), step_rows(found)),
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


ROBOT_PAGE = """\
# A balancing robot: a gearbox that sticks

*This page is written by `python -m wheelpend.benchmarks.measured`; the figures in it are what that command measured.*

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
