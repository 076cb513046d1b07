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
        own_rates, units = list(dict.fromkeys([speed, *rates])), LawUnits.at(port, plant)
        found += [
            Term(port.name, text, (("size", coefficient_unit(powers, units)),), shapes)
            for text, powers, shapes in (
                *constant_terms(),
                *rate_terms(own_rates, covered, units),
                *dry_friction_terms(speed, covered, units),
                *spring_terms([angle, *angles], units),
                *product_terms(own_rates, angles, units),
                *drift_terms(speed, units),
            )
        ]
        found += ripple_terms(port, angle, covered, units) if port.unit == "rad" else []
        found += bump_terms(port, angle, covered, units)
        if len([w for w in port.weights if w]) > 1:
            found += [
                Term(port.name, t, (("size", coefficient_unit(p, units)),), s)
                for t, p, s in input_terms(plant.input, speed, units)
            ]
    return list({t.key: t for t in found}.values())


def distinct_ports(plant: PlantSignature) -> list[PortSpec]:
    """Ports along coordinates of their own: of several along the same one, the first."""
    return list({port.weights: port for port in reversed(plant.ports)}.values())[::-1]


INPUT_POWERS = {"V": 1}  # V stands for the unit of the input
TermSpec = tuple[str, dict[str, int], tuple[ShapeParameter, ...]]


def product_powers(*powers: Mapping[str, int]) -> dict[str, int]:
    """Powers of the units of a product."""
    names = sorted({n for p in powers for n in p})
    return {n: sum(p.get(n, 0) for p in powers) for n in names}


class LawUnits(NamedTuple):
    """Units at a port: of the variables that a law there may depend on, and of the force."""

    names: Mapping[str, str]  # unit of each position and speed
    force: Mapping[str, int]  # powers of V and m
    input: str  # unit of the input

    @staticmethod
    def at(port: PortSpec, plant: PlantSignature) -> LawUnits:
        """Units at a port of a plant."""
        lever = plant.force_unit(port.unit).removeprefix(plant.input_unit)
        force = {**INPUT_POWERS, "m": {"": 0, " m": 1, "/m": -1}[lever]}
        return LawUnits({**plant.positions, **plant.speeds}, force, plant.input_unit)

    def powers(self, name: str) -> dict[str, int]:
        """Powers of a position's or a speed's unit."""
        length, _, time = self.names[name].partition("/")
        return {length: 1, **({"s": -1} if time else {})}


def coefficient_unit(powers: Mapping[str, int], units: LawUnits | None = None) -> str:
    """Unit of a coefficient that turns something with these powers of V, s and rad into V, as in V s²/rad²."""
    force, own = (units.force, units.input) if units else (INPUT_POWERS, "V")
    wanted = {n: force.get(n, 0) - powers.get(n, 0) for n in ("V", "s", "rad", "m")}
    named = {own if n == "V" else n: p for n, p in wanted.items() if n != "V" or own != "1"}
    above = " ".join(n + superscript(p) for n, p in named.items() if p > 0) or "1"
    below = [n + superscript(-p) for n, p in named.items() if p < 0]
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


def rate_terms(rates: Sequence[str], covered: CoveredRange, units: LawUnits) -> Iterator[TermSpec]:
    """Drags that grow with a power of a rate, and smooth signs."""
    for name in rates:
        x, own = bracketed(name), units.powers(name)
        yield f"size*{x}", own, ()
        yield f"size*abs({name})", own, ()
        yield f"size*{x}*abs({name})", product_powers(own, own), ()
        yield f"size*{x}^2", product_powers(own, own), ()
        yield f"size*{x}^3", product_powers(own, own, own), ()
        for width in covered.widths.get(name, ()):
            yield (
                f"size*tanh({x}/width)",
                {},
                (ShapeParameter("width", units.names[name], width, MIN_WIDTH_SHARE * width),),
            )


def dry_friction_terms(speed: str, covered: CoveredRange, units: LawUnits) -> Iterator[TermSpec]:
    """Dry friction, and dry friction that falls with speed."""
    yield f"size*{DIRECTION_ARGUMENT}", {}, ()
    for width in covered.widths.get(speed, ()):
        yield (f"size*{DIRECTION_ARGUMENT}*exp(-({bracketed(speed)}/width)^2)", {},
               (ShapeParameter("width", units.names[speed], width, MIN_WIDTH_SHARE * width),))  # fmt: skip


def spring_terms(angles: Sequence[str], units: LawUnits) -> Iterator[TermSpec]:
    """Springs."""
    for name in angles:
        x, own = bracketed(name), units.powers(name)
        yield f"size*{x}", own, ()
        yield f"size*{x}*abs({name})", product_powers(own, own), ()
        yield f"size*{x}^3", product_powers(own, own, own), ()


def product_terms(rates: Sequence[str], angles: Sequence[str], units: LawUnits) -> Iterator[TermSpec]:
    """Drags that depend on another rate or on an angle."""
    for name in rates:
        x, own = bracketed(name), units.powers(name)
        for other in rates:
            if other != name:
                yield f"size*{x}*abs({other})", product_powers(own, units.powers(other)), ()
        for angle in angles:
            yield f"size*{x}*abs({angle})", product_powers(own, units.powers(angle)), ()
            yield f"size*{x}*{angle}", product_powers(own, units.powers(angle)), ()


def drift_terms(speed: str, units: LawUnits) -> Iterator[TermSpec]:
    """Forces that grow while the log runs."""
    yield "size*t", {"s": 1}, ()
    yield f"size*{bracketed(speed)}*t", product_powers(units.powers(speed), {"s": 1}), ()


def input_terms(name: str, speed: str, units: LawUnits) -> Iterator[TermSpec]:
    """Nonlinearities of a motor or driver in the voltage, and friction that grows with the load."""
    x = bracketed(speed)
    yield f"size*abs({name})", INPUT_POWERS, ()
    yield f"size*{name}*abs({name})", product_powers(INPUT_POWERS, INPUT_POWERS), ()
    yield f"size*{name}^3", product_powers(INPUT_POWERS, INPUT_POWERS, INPUT_POWERS), ()
    yield f"size*{name}*t", product_powers(INPUT_POWERS, {"s": 1}), ()
    yield f"size*{name}*abs({speed})", product_powers(INPUT_POWERS, units.powers(speed)), ()
    yield f"size*{x}*abs({name})", product_powers(INPUT_POWERS, units.powers(speed)), ()
    yield f"size*abs({name})*sign({speed})", INPUT_POWERS, ()


def ripple_terms(port: PortSpec, angle: str, covered: CoveredRange, units: LawUnits) -> list[Term]:
    """Ripples that repeat over a turn of a port, where the logs turn far enough to tell."""
    x, force = bracketed(angle), coefficient_unit({}, units)
    covered_angle = covered.high.get(angle, 0.0) - covered.low.get(angle, 0.0)
    return [
        Term(port.name, f"sine*sin({n}*{x}) + cosine*cos({n}*{x})", (("sine", force), ("cosine", force)), per_log=True)
        for n in HARMONICS_PER_TURN if n * covered_angle > MIN_WAVE_PHASE_RAD
    ]  # fmt: skip


def bump_terms(port: PortSpec, angle: str, covered: CoveredRange, units: LawUnits) -> list[Term]:
    """Pushes at a place."""
    low, high = covered.low.get(angle, 0.0), covered.high.get(angle, 0.0)
    if high - low < MIN_BUMP_TRACK_RAD * port.length_per_radian:
        return []
    size, widths = (("size", coefficient_unit({}, units)),), [share * (high - low) for share in BUMP_WIDTH_SHARES]
    least = MIN_BUMP_WIDTH_SHARE * (high - low)
    return [
        Term(
            port.name,
            f"size*exp(-(({angle} - place)/width)^2)",
            size,
            (ShapeParameter("place", port.unit, float(place), None), ShapeParameter("width", port.unit, width, least)),
        )
        for width in widths
        for place in np.linspace(low, high, BUMP_PLACE_COUNT)
    ]
