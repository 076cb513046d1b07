"""The missing force of the demo log beside the true one: python -m wheelpend.benchmarks.demo_force [--out docs].

At the parameters of the simulated machine the model misses the hidden dry friction and nothing else: 0.3 V on the wheel
and body rows, which change sign with the slip. Writes missing_force.svg and fills the table of method.md.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from wheelpend.benchmarks.markdown import markdown_table, replace_between
from wheelpend.benchmarks.measured.drawing import BEFORE_COLOUR, INK_COLOUR, MUTED_COLOUR, new_figure, save_svg
from wheelpend.diagnosis.compare import fit_at_values, model_to_compare
from wheelpend.diagnosis.missing_force.estimate import MissingForce, estimate_missing_force
from wheelpend.diagnosis.missing_force.smoothed_force import missing_forces
from wheelpend.files import write_text
from wheelpend.logs.shipped import DEMO_LOG, data_folder
from wheelpend.model.record import Model
from wheelpend.reports.console import exit_on_failure, progress
from wheelpend.reports.numbers import digits_text

TRUTH_FILE, TORQUE = "demo_truth.json", "coulomb_drive.torque"
SLIP, ROWS, SIGNS = "dtheta_w - dtheta_p", ("wheel", "body"), (-1.0, 1.0)  # of the friction on the rows
SHOWN_S = (5.0, 7.0)  # s of the log that are drawn
BAND_SIGMAS = 1.96  # of a 95 % band
BEGIN, END = "<!-- demo_force -->\n", "\n<!-- end -->"
METHODS = ("smoothed", "constant over 0.05 s")

app = typer.Typer(add_completion=False)


@app.command()
def main(out: Annotated[Path, typer.Option(help="Folder of method.md and of the picture.")] = Path("docs")) -> None:
    """Draw both estimates beside the truth, and write their errors into method.md."""
    with exit_on_failure(), progress("estimating") as update:
        torque, *found = both_estimates(update)
        draw_both(out / "missing_force.svg", torque, found)
        page = out / "method.md"
        rows = [(name, *error_cells(m, torque)) for name, m in zip(METHODS, found, strict=True)]
        header = ("", *(f"{row} row: RMS error, mean σ [V]; truth in the 95 % band" for row in ROWS))
        filled = replace_between(page.read_text(encoding="utf-8"), BEGIN, END, markdown_table(header, rows))
        write_text(page, filled)


def both_estimates(update) -> tuple[float, MissingForce, MissingForce]:
    """Size of the hidden friction [V], the missing force at the true parameters as smoothed, and in pieces."""
    truth = json.loads((data_folder() / TRUTH_FILE).read_text(encoding="utf-8"))
    compared = model_to_compare(Model.default(), [data_folder() / DEMO_LOG], (), update)
    compared = compared._replace(log_values=[{**v, **truth["parameters"]} for v in compared.log_values])
    problem, fit = compared.own_problem, fit_at_values(compared)
    return truth["effects"][TORQUE], missing_forces(problem, fit)[0], estimate_missing_force(problem, fit)


def true_force(missing: MissingForce, torque: float) -> np.ndarray:
    """The friction (n, rows) [V] at the times of an estimate."""
    return np.multiply.outer(torque * np.sign(missing.variables[SLIP]), SIGNS)


def error_cells(missing: MissingForce, torque: float) -> list[str]:
    """RMS error, mean standard deviation and coverage of the band on each row."""
    error = missing.force - true_force(missing, torque)
    inside = np.mean(np.abs(error) < BAND_SIGMAS * missing.sigma, axis=0)
    rms = np.sqrt(np.mean(error**2, axis=0))
    return [
        f"{digits_text(float(r), 2)}, {digits_text(float(s), 2)}; {100 * i:.0f} %"
        for r, s, i in zip(rms, missing.sigma.mean(axis=0), inside, strict=True)
    ]


def draw_both(path: Path, torque: float, found: list[MissingForce]) -> None:
    """Both estimates with their bands and the true force on the wheel row, over two seconds."""
    figure, axes = new_figure(7, 3.8, len(found))
    for ax, name, missing in zip(axes, METHODS, found, strict=True):
        shown = (missing.t > SHOWN_S[0]) & (missing.t < SHOWN_S[1])
        t, force, half = missing.t[shown], missing.force[shown, 0], BAND_SIGMAS * missing.sigma[shown, 0]
        ax.fill_between(t, force - half, force + half, color=BEFORE_COLOUR, alpha=0.3, lw=0, label="95 % band")
        ax.plot(t, force, color=BEFORE_COLOUR, lw=0.9, label="estimated")
        ax.plot(t, true_force(missing, torque)[shown, 0], color=INK_COLOUR, lw=0.9, ls="--", label="true")
        ax.axhline(0.0, color=MUTED_COLOUR, lw=0.5)
        ax.set_title(name, fontsize=9, loc="left", color=INK_COLOUR)
        ax.set_ylabel("wheel row [V]")
    axes[0].legend(frameon=False, ncols=3, fontsize=8, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    axes[-1].set_xlabel("time [s]")
    save_svg(figure, path)


if __name__ == "__main__":
    app()
