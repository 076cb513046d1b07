"""The regressor, and the filters behind which it is formed without accelerations."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import sympy as sp

from derive.algebra import derivative, expand
from derive.functions import symbol
from derive.kernels.arguments import nonzero, nonzero_entries, regressor_sources, trig_sources, with_trig_arguments
from derive.printing import Kernel, Target, kernel, local_name
from derive.records import Model


class Signal(NamedTuple):
    """A quantity to be filtered for the regression, and how often it is differentiated."""

    value: sp.Expr
    derivatives: int  # 0, 1 or 2
    held: bool  # True where it is constant between samples, as the input is


class FilteredRegression(NamedTuple):
    """The filtered regression: signals, and the features that its rows are made of.

    A feature is a sum of filtered signals that always come together; ``rows`` hold, for each row of the regression, the
    weights of the features in each column of φ and then in τ.
    """

    signals: tuple[Signal, ...]
    features: tuple[tuple[tuple[float, int], ...], ...]  # weight and signal
    rows: tuple[tuple[tuple[float, ...], ...], ...]  # (NQ, parameters + 1, features)


class FilterPlan(NamedTuple):
    """Signals, features and their weights in the filtered regression; numbers only."""

    signals: tuple[tuple[int, bool], ...]  # derivatives, held
    shared: tuple[tuple[int, ...], ...]  # signals read from each filter, which differ in their derivatives alone
    features: tuple[tuple[tuple[float, int], ...], ...]  # weight and signal
    mixing: tuple[tuple[tuple[float, ...], ...], ...]  # weights of the features in [φ τ]


def filter_plan(filtered: FilteredRegression) -> FilterPlan:
    """The filtered regression without its expressions."""
    return FilterPlan(
        signals=tuple((s.derivatives, s.held) for s in filtered.signals),
        shared=shared_filters(filtered.signals),
        features=filtered.features,
        mixing=filtered.rows,
    )


def regression_kernels(model: Model, filtered: FilteredRegression) -> dict[str, Kernel]:
    """The regressor at given accelerations, in parts, as an energy balance, and filtered."""
    return {
        "regressor": regressor_kernel(model),
        "regressor_parts": regressor_parts_kernel(model),
        "energy_parts": energy_parts_kernel(model),
        "signal_rates": signal_rates_kernel(model, filtered.signals),
        "signals": signals_kernel(model, filtered.signals),
        **assembly_kernels(filtered),
    }


def filtered_regression(model: Model) -> FilteredRegression:
    """The filtered regression of a model: each distinct term of its entries is one signal, whatever its factor."""
    regressor, count = model.regressor, len(model.regressor.parameters)
    entries: dict[tuple[sp.Expr, int], dict[tuple[int, int], float]] = {}  # term and derivatives → weight in each entry
    pieces = enumerate((regressor.phi0, regressor.phi1, regressor.phi2))
    for derivatives, matrix in [*pieces, (0, regressor.tau)]:
        for place, entry in enumerate(matrix):
            row, column = divmod(place, count) if matrix is not regressor.tau else (place, count)
            for term in sp.Add.make_args(expand(entry)):
                weight, value = term.as_coeff_Mul()
                if weight:
                    shares = entries.setdefault((value, derivatives), {})
                    shares[row, column] = shares.get((row, column), 0.0) + float(weight)
    together: dict[tuple, list[tuple[float, int]]] = {}  # entries that a feature is in → its signals
    signals: list[Signal] = []
    for (value, derivatives), shares in entries.items():
        scale = next(iter(shares.values()))
        pattern = tuple(sorted((place, weight / scale) for place, weight in shares.items()))
        together.setdefault(pattern, []).append((scale, len(signals)))
        signals.append(Signal(value, derivatives, value.has(*model.plant.inputs) and not model.lag))
    rows = [[[0.0] * len(together) for _ in range(count + 1)] for _ in range(regressor.tau.rows)]
    for feature, pattern in enumerate(together):
        for (row, column), weight in pattern:
            rows[row][column][feature] = weight
    return FilteredRegression(
        tuple(signals), tuple(map(tuple, together.values())), tuple(tuple(map(tuple, row)) for row in rows)
    )


def shared_filters(signals: tuple[Signal, ...]) -> tuple[tuple[int, ...], ...]:
    """Signals that enter the filters as the same quantity, however often they are differentiated after it."""
    together: dict[tuple[sp.Expr, bool], list[int]] = {}
    for n, s in enumerate(signals):
        together.setdefault((s.value, s.held), []).append(n)
    return tuple(map(tuple, together.values()))


def regressor_kernel(model: Model) -> Kernel:
    """Left side and regressor at given accelerations (paper eqs. 21-23)."""
    regressor = model.regressor
    targets = [Target(f"tau[{n}]", value) for n, value in enumerate(regressor.tau)]
    return kernel(targets + nonzero("phi", regressor.phi), regressor_sources(model))


def regressor_parts_kernel(model: Model) -> Kernel:
    """The three pieces without accelerations (paper eqs. 25, 26)."""
    regressor = model.regressor
    pieces = {"phi2": regressor.phi2, "phi1": regressor.phi1, "phi0": regressor.phi0}
    return kernel([t for name, piece in pieces.items() for t in nonzero(name, piece)], regressor_sources(model))


def energy_parts_kernel(model: Model) -> Kernel:
    """Energy stored and power taken per parameter, and power supplied: the regressor without accelerations."""
    energy = model.regressor.energy
    targets = nonzero_entries("stored", energy.stored) + nonzero_entries("taken", energy.taken)
    return kernel([*targets, Target("supplied[0]", energy.supplied)], regressor_sources(model))


def signals_kernel(model: Model, signals: tuple[Signal, ...]) -> Kernel:
    """The quantities that are filtered, in the states and the angles' sines and cosines."""
    weights = {s.direction.name: s.slip for s in model.surfaces}
    rates = [local_name(s.name) for s in model.states[len(model.states) // 2 :]]
    slips = {
        name: f"_sign({' + '.join(f'{w} * {r}' for w, r in zip(slip, rates, strict=False) if w)})"
        for name, slip in weights.items()
    }
    targets = [Target(f"signal_{n}", s.value) for n, s in enumerate(signals)]
    return kernel(with_trig_arguments(model, targets), {**trig_sources(model), **slips})


def signal_rates_kernel(model: Model, signals: tuple[Signal, ...]) -> Kernel:
    """Time derivatives of the signals that are differentiated twice; they are functions of the configuration."""
    targets = []
    for n, s in enumerate(signals):
        if s.derivatives == 2:
            rate = sp.Add(*(derivative(s.value, c.q) * c.dq for c in model.plant.coordinates))
            targets.append(Target(f"speed[{n}]", rate))
    return kernel(targets, regressor_sources(model))


def assembly_kernels(filtered: FilteredRegression) -> dict[str, Kernel]:
    """The features from the filtered signals, and left side and regressor from the features (paper eqs. 39, 40)."""
    signals, features = (
        [symbol(f"{kind}_{n}") for n in range(len(of))]
        for kind, of in (("signal", filtered.signals), ("feature", filtered.features))
    )
    sums = [weighted_sum((w, signals[n]) for w, n in feature) for feature in filtered.features]
    rows = sp.Matrix([[weighted_sum(zip(weights, features, strict=True)) for weights in row] for row in filtered.rows])
    names = {s.name: s.name for s in (*signals, *features)}
    left = [Target(f"tau[{n}]", v) for n, v in enumerate(rows[:, -1])]
    return {
        "features": kernel([Target(f.name, value) for f, value in zip(features, sums, strict=True)], names),
        "assemble": kernel(left + nonzero("phi", rows[:, :-1]), names),
    }


def weighted_sum(terms: Iterable[tuple[float, sp.Symbol]]) -> sp.Expr:
    """Sum of symbols with weights as they are printed."""
    return sp.Add(*(printed_weight(w) * s for w, s in terms))


def printed_weight(value: float) -> sp.Expr:
    """A weight as it is printed: 1, not 1.0."""
    return sp.Integer(int(value)) if value == int(value) else sp.Float(value)
