"""How the parameters of a fit depend on each other: correlations of their estimates."""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np

from wheelpend.estimation.fit import Fit
from wheelpend.reports.numbers import correlation_text

MIN_STRONG_CORRELATION = 0.9  # from which the logs tell two parameters apart badly
MAX_CORRELATED_PARAMETERS = 16  # of the table
MAX_NAMED_PAIRS = 3  # in the sentence


class Correlation(NamedTuple):
    """A cell of the table."""

    text: str
    strong: bool


class CorrelationTable(NamedTuple):
    """Correlations of the first parameters, row by row up to the diagonal, and what they mean."""

    names: list[str]
    rows: list[list[Correlation]]
    sentence: str


def correlation_table(fitted: Fit) -> CorrelationTable | None:
    """The table of a fit, in its first log where logs have their own; None where no two parameters are known."""
    places = {n: fitted.place(n) for n in fitted.names}
    variances = np.diag(fitted.covariance)
    names = [n for n, k in places.items() if np.isfinite(variances[k]) and variances[k] > 0.0]
    names = names[:MAX_CORRELATED_PARAMETERS]
    if len(names) < 2:
        return None
    chosen = [places[n] for n in names]
    sigma = np.sqrt(variances[chosen])
    found = fitted.covariance[np.ix_(chosen, chosen)] / np.outer(sigma, sigma)
    rows = [[_cell(found[a, b], a == b) for b in range(a + 1)] for a in range(len(names))]
    return CorrelationTable(names, rows, _sentence(names, found))


def _cell(value: float, own: bool) -> Correlation:
    return Correlation(correlation_text(value), not own and abs(value) >= MIN_STRONG_CORRELATION)


def _sentence(names: list[str], found: np.ndarray) -> str:
    pairs = sorted(combinations(range(len(names)), 2), key=lambda pair: -abs(found[pair]))
    strong = [pair for pair in pairs if abs(found[pair]) >= MIN_STRONG_CORRELATION]
    a, b = pairs[0]
    if not strong:
        return (f"No two parameters hide behind each other: the strongest correlation is that of {names[a]} and "
                f"{names[b]}, {correlation_text(found[a, b])}.")  # fmt: skip
    told = ", ".join(f"{names[a]} and {names[b]}" for a, b in strong[:MAX_NAMED_PAIRS])
    return f"These logs know a combination of {told} better than each of them (correlation of 0.9 or more)."
