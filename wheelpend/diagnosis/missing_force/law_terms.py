"""The terms of which a free-form law is made: physically dimensioned, each a text of the grammar of own effects.

A term acts on a port of the plant as a resistance there, as an own effect does. Its coefficients have the unit that
makes it a force [V]; a shape (a width, a place) has a value that is tried and later refitted.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from derive.effects.row import DIRECTION_ARGUMENT
from derive.plant_signature import PlantSignature, PortSpec, combination_text
from wheelpend.diagnosis.criteria import MIN_WAVE_PHASE_RAD

WIDTH_QUANTILES = (0.1, 0.3, 0.6, 0.9)  # quantiles of a speed's magnitude that are tried as the width of a bend
MIN_WIDTH_SHARE = 0.02  # of such a width, that it may be refitted to
BUMP_PLACE_COUNT = 10  # places of a bump along the track
BUMP_WIDTH_SHARES = (0.3, 0.15, 0.07)  # widths of a bump as shares of the track
MIN_BUMP_WIDTH_SHARE = 0.01  # of the track, that a width may be refitted to
MIN_BUMP_TRACK_RAD = 0.5  # rad that a log must cover to show a bump
HARMONICS_PER_TURN = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24)  # periods per turn


class ShapeParameter(NamedTuple):
    """A parameter of a term in which it is not linear."""

    name: str
    unit: str
    value: float
    minimum: float | None


class Term(NamedTuple):
    """One term of a law."""

    port: str
    text: str  # with its coefficients and shapes by name
    sizes: tuple[tuple[str, str], ...]  # coefficients in which the term is linear, with their units
    shapes: tuple[ShapeParameter, ...] = ()
    per_log: bool = False  # every log has coefficients of its own, as the phase of a wave has

    @property
    def dry(self) -> bool:
        """Acting at rest too, as dry friction does."""
        return DIRECTION_ARGUMENT in self.text

    @property
    def key(self) -> str:
        """Text and shapes, by which terms differ."""
        return f"{self.port}: {self.text} {[s.value for s in self.shapes]}"


class CoveredRange(NamedTuple):
    """Ranges that the logs cover: least, greatest value and quantiles of the magnitude of each variable."""

    low: dict[str, float]
    high: dict[str, float]
    widths: dict[str, tuple[float, ...]]


def covered_range(values: Mapping[str, np.ndarray]) -> CoveredRange:
    """Ranges of variables from their values."""
    widths = {n: tuple(map(float, np.unique(np.quantile(np.abs(v), WIDTH_QUANTILES)))) for n, v in values.items()}
    return CoveredRange(
        {n: float(v.min()) for n, v in values.items()}, {n: float(v.max()) for n, v in values.items()}, widths
    )


# ---- the library


def term_library(plant: PlantSignature, covered: CoveredRange) -> list[Term]:
    """Every term that may act on a plant's ports, as far as the logs cover what it depends on."""
    angles, rates = [c.q for c in plant.coordinates], [c.dq for c in plant.coordinates]
    found = []
    for port in distinct_ports(plant):
        angle, speed = combination_text(angles, port.weights), combination_text(rates, port.weights)
        own_rates = list(dict.fromkeys([speed, *rates]))
        found += [
            Term(port.name, text, (("size", coefficient_unit(powers)),), shapes)
            for text, powers, shapes in (
                *constant_terms(),
                *rate_terms(own_rates, covered),
                *dry_friction_terms(speed, covered),
                *spring_terms([angle, *angles]),
                *product_terms(own_rates, angles),
                *drift_terms(speed),
            )
        ]
        found += ripple_terms(port.name, angle, covered)
        found += bump_terms(port.name, angle, covered)
        if len([w for w in port.weights if w]) > 1:
            found += [
                Term(port.name, t, (("size", coefficient_unit(p)),), s) for t, p, s in input_terms(plant.input, speed)
            ]
    return list({t.key: t for t in found}.values())


def distinct_ports(plant: PlantSignature) -> list[PortSpec]:
    """Ports along coordinates of their own: of several along the same one, the first."""
    return list({port.weights: port for port in reversed(plant.ports)}.values())[::-1]


RATE_UNIT_POWERS, ANGLE_UNIT_POWERS, VOLTAGE_UNIT_POWERS = {"rad": 1, "s": -1}, {"rad": 1}, {"V": 1}
TermSpec = tuple[str, dict[str, int], tuple[ShapeParameter, ...]]


def product_powers(*powers: Mapping[str, int]) -> dict[str, int]:
    """Powers of the units of a product."""
    names = sorted({n for p in powers for n in p})
    return {n: sum(p.get(n, 0) for p in powers) for n in names}


def coefficient_unit(powers: Mapping[str, int]) -> str:
    """Unit of a coefficient that turns something with these powers of V, s and rad into V, as in V s²/rad²."""
    wanted = {n: (n == "V") - powers.get(n, 0) for n in ("V", "s", "rad")}
    above = " ".join(n + superscript(p) for n, p in wanted.items() if p > 0) or "1"
    below = [n + superscript(-p) for n, p in wanted.items() if p < 0]
    return above + ("" if not below else f"/{below[0]}" if len(below) == 1 else f"/({' '.join(below)})")


def superscript(power: int) -> str:
    """A power as people write it, nothing for 1."""
    return "" if power == 1 else str(power).translate(str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹"))


def bracketed(name: str) -> str:
    """A name, or a combination in brackets."""
    return f"({name})" if " " in name else name


def constant_terms() -> Iterator[TermSpec]:
    """The same force always."""
    yield "size", {}, ()


def rate_terms(rates: Sequence[str], covered: CoveredRange) -> Iterator[TermSpec]:
    """Drags that grow with a power of a rate, and smooth signs."""
    for name in rates:
        x = bracketed(name)
        yield f"size*{x}", RATE_UNIT_POWERS, ()
        yield f"size*abs({name})", RATE_UNIT_POWERS, ()
        yield f"size*{x}*abs({name})", product_powers(RATE_UNIT_POWERS, RATE_UNIT_POWERS), ()
        yield f"size*{x}^2", product_powers(RATE_UNIT_POWERS, RATE_UNIT_POWERS), ()
        yield f"size*{x}^3", product_powers(RATE_UNIT_POWERS, RATE_UNIT_POWERS, RATE_UNIT_POWERS), ()
        for width in covered.widths.get(name, ()):
            yield f"size*tanh({x}/width)", {}, (ShapeParameter("width", "rad/s", width, MIN_WIDTH_SHARE * width),)


def dry_friction_terms(speed: str, covered: CoveredRange) -> Iterator[TermSpec]:
    """Dry friction, and dry friction that falls with speed."""
    yield f"size*{DIRECTION_ARGUMENT}", {}, ()
    for width in covered.widths.get(speed, ()):
        yield (f"size*{DIRECTION_ARGUMENT}*exp(-({bracketed(speed)}/width)^2)", {},
               (ShapeParameter("width", "rad/s", width, MIN_WIDTH_SHARE * width),))  # fmt: skip


def spring_terms(angles: Sequence[str]) -> Iterator[TermSpec]:
    """Springs."""
    for name in angles:
        x = bracketed(name)
        yield f"size*{x}", ANGLE_UNIT_POWERS, ()
        yield f"size*{x}*abs({name})", product_powers(ANGLE_UNIT_POWERS, ANGLE_UNIT_POWERS), ()
        yield f"size*{x}^3", product_powers(ANGLE_UNIT_POWERS, ANGLE_UNIT_POWERS, ANGLE_UNIT_POWERS), ()


def product_terms(rates: Sequence[str], angles: Sequence[str]) -> Iterator[TermSpec]:
    """Drags that depend on another rate or on an angle."""
    for name in rates:
        x = bracketed(name)
        for other in rates:
            if other != name:
                yield f"size*{x}*abs({other})", product_powers(RATE_UNIT_POWERS, RATE_UNIT_POWERS), ()
        for angle in angles:
            yield f"size*{x}*abs({angle})", product_powers(RATE_UNIT_POWERS, ANGLE_UNIT_POWERS), ()
            yield f"size*{x}*{angle}", product_powers(RATE_UNIT_POWERS, ANGLE_UNIT_POWERS), ()


def drift_terms(speed: str) -> Iterator[TermSpec]:
    """Forces that grow while the log runs."""
    yield "size*t", {"s": 1}, ()
    yield f"size*{bracketed(speed)}*t", product_powers(RATE_UNIT_POWERS, {"s": 1}), ()


def input_terms(name: str, speed: str) -> Iterator[TermSpec]:
    """Nonlinearities of a motor or driver in the voltage, and friction that grows with the load."""
    x = bracketed(speed)
    yield f"size*abs({name})", VOLTAGE_UNIT_POWERS, ()
    yield f"size*{name}*abs({name})", product_powers(VOLTAGE_UNIT_POWERS, VOLTAGE_UNIT_POWERS), ()
    yield f"size*{name}^3", product_powers(VOLTAGE_UNIT_POWERS, VOLTAGE_UNIT_POWERS, VOLTAGE_UNIT_POWERS), ()
    yield f"size*{name}*t", product_powers(VOLTAGE_UNIT_POWERS, {"s": 1}), ()
    yield f"size*{name}*abs({speed})", product_powers(VOLTAGE_UNIT_POWERS, RATE_UNIT_POWERS), ()
    yield f"size*{x}*abs({name})", product_powers(VOLTAGE_UNIT_POWERS, RATE_UNIT_POWERS), ()
    yield f"size*abs({name})*sign({speed})", VOLTAGE_UNIT_POWERS, ()


def ripple_terms(port: str, angle: str, covered: CoveredRange) -> list[Term]:
    """Ripples that repeat over a turn of a port, where the logs turn far enough to tell."""
    x = bracketed(angle)
    covered_angle = covered.high.get(angle, 0.0) - covered.low.get(angle, 0.0)
    return [
        Term(port, f"sine*sin({n}*{x}) + cosine*cos({n}*{x})", (("sine", "V"), ("cosine", "V")), per_log=True)
        for n in HARMONICS_PER_TURN if n * covered_angle > MIN_WAVE_PHASE_RAD
    ]  # fmt: skip


def bump_terms(port: str, angle: str, covered: CoveredRange) -> list[Term]:
    """Pushes at a place."""
    low, high = covered.low.get(angle, 0.0), covered.high.get(angle, 0.0)
    if high - low < MIN_BUMP_TRACK_RAD:
        return []
    return [
        Term(port, f"size*exp(-(({angle} - place)/width)^2)", (("size", "V"),),
             (ShapeParameter("place", "rad", float(place), None), ShapeParameter("width", "rad", share * (high - low),
                                                              MIN_BUMP_WIDTH_SHARE * (high - low))))
        for share in BUMP_WIDTH_SHARES for place in np.linspace(low, high, BUMP_PLACE_COUNT)
    ]  # fmt: skip
