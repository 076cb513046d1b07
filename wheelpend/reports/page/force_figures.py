"""Figures of the missing force: over time, over the states, and what of it repeats."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go
import sympy as sp
from plotly.subplots import make_subplots

import derive
from derive.effects import DryForce, Force, InputDelay, InputLag, SensorMap
from derive.functions import symbol
from wheelpend.diagnosis.evidence import CandidateFit
from wheelpend.diagnosis.missing_force.estimate import MissingForce
from wheelpend.diagnosis.missing_force.repeatability import ExplainedForce
from wheelpend.diagnosis.missing_force.smoothed_force import pooled
from wheelpend.diagnosis.verdict import Diagnosis
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.state_reconstruction import port_motion
from wheelpend.logs.log import stack_inputs
from wheelpend.model.units import PlantUnits
from wheelpend.reports.names import axis_name_text
from wheelpend.reports.page.binning import bin_means, quantile_bins
from wheelpend.reports.page.law_expressions import LAMBDIFY_MODULES, resistance_law
from wheelpend.reports.page.style import (
    BEFORE_COLOUR,
    BEFORE_RGB,
    MAX_CLOUD_POINTS,
    MUTED_COLOUR,
    STEP_COLOURS,
    with_page_style,
)
from wheelpend.reports.page.thinning import extreme_samples

BAND_STANDARD_ERRORS = 2.0  # half width of a band
BAND_NAME = "± 2 standard deviations"
SHOWN_FORCE_QUANTILES = (0.005, 0.995)  # of the missing force, between which the chart over a state lies


def force_figure(missing: MissingForce, rows: Sequence[str], q: PlantUnits, points: int) -> go.Figure:
    """Missing force on each row over time, with a band of two standard deviations, at some ``points`` at most."""
    figure = make_subplots(rows=len(rows), cols=1, shared_xaxes=True, vertical_spacing=0.06)
    order = np.argsort(missing.t)
    for k, row in enumerate(rows):
        shown = order[extreme_samples([missing.force[order, k]], 0, len(order), points)]
        t, force, band = missing.t[shown], missing.force[shown, k], BAND_STANDARD_ERRORS * missing.sigma[shown, k]
        edge = np.concatenate([force + band, (force - band)[::-1]])
        figure.add_trace(go.Scatter(
            x=np.concatenate([t, t[::-1]]).astype(np.float32), y=edge.astype(np.float32), fill="toself", mode="none",
            fillcolor=f"rgba({BEFORE_RGB},0.22)", hoverinfo="skip", name=BAND_NAME, showlegend=k == 0,
        ), row=k + 1, col=1)  # fmt: skip
        figure.add_trace(
            go.Scatter(
                x=t.astype(np.float32),
                y=force.astype(np.float32),
                mode="lines",
                line={"color": BEFORE_COLOUR, "width": 1.4},
                name="missing force",
                showlegend=k == 0,
                **force_hover(force, q, row),
            ),
            row=k + 1,
            col=1,
        )
        figure.update_yaxes(title=f"{row} row [{q.force_on(row)}]", row=k + 1, col=1)
    figure.update_xaxes(title="time [s]", row=len(rows), col=1)
    return with_page_style(figure, 90 + 190 * len(rows))


def force_hover(force: np.ndarray, q: PlantUnits, row: str) -> dict:
    """Hover text of a force on a row in V, and in N·m where the plant's volt is known."""
    unit, known = "" if q.force_on(row) == "1" else f" {q.force_on(row)}", q.in_physical(1.0, q.force_on(row))
    if known is None:
        return {"hovertemplate": f"%{{x:.4g}}: %{{y:.3g}}{unit}<extra></extra>"}
    shown = f"%{{x:.4g}}: %{{y:.3g}}{unit} = %{{customdata:.3g}} {known[1]}<extra></extra>"
    return {"customdata": np.asarray(force * known[0], dtype=np.float32), "hovertemplate": shown}


def worst_row_and_state(diagnosis: Diagnosis) -> tuple[int, str]:
    """Row index and state where the missing force is concentrated most."""
    rows = diagnosis.problem.module.ROWS
    if not diagnosis.where:
        module = diagnosis.problem.module
        return 0, next((n for n, w in port_motion(module).items() if w[module.NQ :].any()), module.STATES[module.NQ])
    return list(rows).index(diagnosis.where[0].row), diagnosis.where[0].state


def state_figure(diagnosis: Diagnosis, q: PlantUnits) -> go.Figure | None:
    """Missing force over the state where it is concentrated: at samples, with its band, and by each candidate."""
    row, state = worst_row_and_state(diagnosis)
    if not diagnosis.missing or state not in diagnosis.missing[0].variables:
        return None
    figure, missing = go.Figure(), pooled(diagnosis.missing)
    name, force = diagnosis.problem.module.ROWS[row], missing.force[:, row]
    _add_force_over_state(figure, missing, (row, state), q, name)
    for number, candidate in enumerate(diagnosis.candidates[: len(STEP_COLOURS)]):
        _add_candidate(figure, diagnosis, candidate, (row, state), STEP_COLOURS[number])
    spread = np.quantile(force, SHOWN_FORCE_QUANTILES)
    figure.update_yaxes(title=f"missing force, {name} row [{q.force_on(name)}]",
                        range=[spread[0] - 0.15 * np.ptp(spread), spread[1] + 0.15 * np.ptp(spread)])  # fmt: skip
    figure.update_xaxes(title=f"{axis_name_text(state, q)} [{q.unit(state)}]")
    return with_page_style(figure, 440)


def _add_force_over_state(
    figure: go.Figure, missing: MissingForce, place: tuple[int, str], q: PlantUnits, name: str
) -> None:
    """Draw the samples, their means over ranges of the state, and the band of a single one there."""
    x, force, sigma = missing.variables[place[1]], missing.force[:, place[0]], missing.sigma[:, place[0]]
    thin = slice(None, None, max(1, -(-len(x) // MAX_CLOUD_POINTS)))
    figure.add_trace(go.Scatter(
        x=x[thin].astype(np.float32), y=force[thin].astype(np.float32), mode="markers", name="missing force",
        marker={"color": MUTED_COLOUR, "size": 3, "opacity": 0.5}, **force_hover(force[thin], q, name),
    ))  # fmt: skip
    bins = quantile_bins(x)
    means = bin_means(x, force, bins)
    half = BAND_STANDARD_ERRORS * np.sqrt(bin_means(x, sigma**2, bins)[:, 1])
    figure.add_trace(go.Scatter(
        x=np.concatenate([means[:, 0], means[::-1, 0]]),
        y=np.concatenate([means[:, 1] + half, (means[:, 1] - half)[::-1]]), fill="toself", mode="none",
        fillcolor=f"rgba({BEFORE_RGB},0.22)", hoverinfo="skip", name=BAND_NAME,
    ))  # fmt: skip
    figure.add_trace(go.Scatter(
        x=means[:, 0], y=means[:, 1], error_y={"array": means[:, 2], "color": BEFORE_COLOUR}, mode="markers",
        marker={"color": BEFORE_COLOUR, "size": 8}, name="mean ± std. error", **force_hover(means[:, 1], q, name),
    ))  # fmt: skip


def _add_candidate(
    figure: go.Figure, diagnosis: Diagnosis, candidate: CandidateFit, place: tuple[int, str], colour: str
) -> None:
    """Draw a candidate: its law where it is a force over this state, and the force that its refit would leave."""
    row, state = place
    x = pooled(diagnosis.missing).variables[state]
    law = law_over_state(diagnosis.problem, candidate, row, state)
    if law is not None:
        grid = np.linspace(float(x.min()), float(x.max()), 401)
        figure.add_trace(go.Scatter(x=grid, y=law(grid), mode="lines", name=f"{candidate.effect}, law alone",
                                    line={"color": colour, "width": 1.5, "dash": "dot"}))  # fmt: skip
    found = [missing_force_if_true(diagnosis, candidate, k) for k in range(len(diagnosis.missing))]
    whole = [f for f in found if f is not None]
    if len(whole) == len(diagnosis.missing):
        curve = bin_means(x, np.concatenate(whole)[:, row], quantile_bins(x))
        figure.add_trace(go.Scatter(x=curve[:, 0], y=curve[:, 1], mode="lines", name=f"{candidate.effect}, refitted",
                                    line={"color": colour, "width": 2.5}))  # fmt: skip


def law_over_state(problem: EstimationProblem, candidate: CandidateFit, row: int, state: str):
    """The force of an effect on a row as a function of one state, or None where it is not one.

    A resistance opposes its port: Q = −law · ∂port/∂q.
    """
    effect = derive.effects.find(candidate.effect)
    if not isinstance(effect.enters, Force | DryForce):
        return None
    plant = derive.plants.build(problem.model.plant, problem.model.assumptions)
    angle = plant.port(effect.enters.port).coordinate
    speed = port_speed(angle, plant)
    along = symbol("along")
    known = {s.name: s for c in plant.coordinates for s in (c.q, c.dq)}
    is_speed = sp.sympify(state, locals=known) == speed
    law = resistance_law(effect, symbol("angle"), along if is_speed else symbol("speed"))
    law = law.subs({effect.symbols[n]: v for n, v in candidate.coefficients.items()})
    share = angle.diff(plant.coordinates[row].q)
    if law.free_symbols != {along} or not share.is_number or share == 0:
        return None
    return sp.lambdify(along, -law * share, LAMBDIFY_MODULES)


def port_speed(angle: sp.Expr, plant) -> sp.Expr:
    """Speed of a port."""
    return sp.Add(*(angle.diff(c.q) * c.dq for c in plant.coordinates))


def missing_force_if_true(diagnosis: Diagnosis, candidate: CandidateFit, number: int = 0) -> np.ndarray | None:
    """The force (n, rows) [V] that the old model would miss in a log, by its number, if the candidate were the truth.

    The old model's equations are evaluated with the refitted candidate's accelerations: what they leave is the force.
    None for sensors, delays and lags, which are no forces, for effects by which something else moves, which these
    equations do not have, and where a constant is unknown.
    """
    problem, enters = diagnosis.problem, derive.effects.find(candidate.effect).enters
    if number >= len(diagnosis.missing) or isinstance(enters, SensorMap | InputDelay | InputLag):
        return None
    if not problem.knows(candidate.effect):
        return None
    table, log = diagnosis.missing[number].variables, diagnosis.missing[number].log
    index = next((k for k, own in enumerate(problem.logs) if own.name == log), None)
    if index is None:
        return None
    states = np.column_stack([table[n] for n in problem.module.STATES])
    parameters = kernel_parameters(problem.module, candidate.fit.of_log(index), problem.logs[index])
    rates = np.array([problem.module.acceleration(t, s, v, parameters)
                      for t, s, v in zip(table["t"], states, input_samples(problem, table), strict=True)])  # fmt: skip
    found = _equation_residuals(problem, diagnosis.fit.of_log(index), table, rates)
    return found if found is not None and np.isfinite(found).all() else None


def input_samples(problem: EstimationProblem, table: dict[str, np.ndarray]) -> np.ndarray:
    """Input columns of a table of variables (n, inputs); 0 where nothing drives the machine."""
    return stack_inputs([table[name] for name in problem.module.INPUTS], len(table["t"]))


def _equation_residuals(
    problem: EstimationProblem, values: Mapping[str, float], table: dict[str, np.ndarray], rates: np.ndarray
) -> np.ndarray | None:
    model = derive.compose(problem.model.plant, problem.model.assumptions, problem.model.effects)
    known = {**values, "origin": float(table[problem.module.STATES[0]][0]), **table}
    known |= {f"dd{c.name}": rates[:, k] for k, c in enumerate(model.plant.coordinates)}
    columns = []
    for row, residual in enumerate(model.residual):
        for surface in model.surfaces:
            slip = sum(w * c.dq for w, c in zip(surface.slip, model.plant.coordinates, strict=True))
            residual = residual + surface.slip[row] * surface.law.subs(surface.direction, derive.functions.Sign(slip))
        names = sorted(residual.free_symbols, key=str)
        if any(s.name not in known for s in names):
            return None
        found = sp.lambdify(names, residual, LAMBDIFY_MODULES)(*(known[s.name] for s in names))
        columns.append(np.broadcast_to(found, table["t"].shape))
    return np.column_stack(columns)


def explained_force_figure(found: ExplainedForce, q: PlantUnits) -> go.Figure:
    """The missing force over each variable it depends on, the others at their medians, with a band of two σ."""
    figure = make_subplots(rows=1, cols=len(found.curves), shared_yaxes=True, horizontal_spacing=0.04)
    for number, c in enumerate(found.curves, 1):
        band = BAND_STANDARD_ERRORS * c.sigma
        figure.add_trace(go.Scatter(
            x=np.concatenate([c.x, c.x[::-1]]), y=np.concatenate([c.force + band, (c.force - band)[::-1]]),
            fill="toself", mode="none", fillcolor=f"rgba({BEFORE_RGB},0.25)", hoverinfo="skip",
            name=BAND_NAME, showlegend=number == 1,
        ), row=1, col=number)  # fmt: skip
        figure.add_trace(go.Scatter(
            x=c.x, y=c.force, mode="lines", line={"color": BEFORE_COLOUR, "width": 2}, name="missing force",
            showlegend=number == 1, **force_hover(c.force, q, found.row),
        ), row=1, col=number)  # fmt: skip
        base, _, within = c.variable.partition(" within")
        figure.update_xaxes(title=f"{axis_name_text(base, q)}{' within' + within if within else ''} [{q.unit(base)}]",
                            row=1, col=number)  # fmt: skip
    figure.update_yaxes(title=f"missing force [{q.force_on(found.row)}]", row=1, col=1)
    return with_page_style(figure, 380)


def most_repeatable_figure(repeats: Sequence[ExplainedForce], q: PlantUnits) -> go.Figure | None:
    """The missing force over what it depends on, on the row where it repeats most."""
    return explained_force_figure(repeats[0], q) if repeats and repeats[0].curves else None
