"""The terms of which a free-form law is made: physically dimensioned, each a text of the grammar of own effects.

A term acts on a port of the plant as a resistance there, as an own effect does. Its coefficients have the unit that
makes it a force [V]; a shape (a width, a place) has a value that is tried and later refitted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from derive.effects.row import DIRECTION
from derive.late import sp, symbol
from derive.nameplate import Nameplate, Place
from wheelpend.estimation.state_reconstruction import signed

NUMERIC = [{"Sign": np.sign, "Step": lambda x: 1.0 * (x > 0), "Magnitude": np.abs,
            "Ramp": lambda x: np.maximum(x, 0.0)}, "numpy"]  # fmt: skip
WIDTHS = (0.1, 0.3, 0.6, 0.9)  # quantiles of a speed's magnitude that are tried as the width of a bend
PLACES, BROAD = 10, (0.3, 0.15, 0.07)  # of a bump: places along the track, and widths as shares of it
TURNS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24)  # periods per turn
WAVE = 3.0  # rad of phase that a log must cover to tell a wave


class Shape(NamedTuple):
    """A number inside a term that is no size."""

    name: str
    unit: str
    value: float
    minimum: float | None


class Term(NamedTuple):
    """One term of a law."""

    port: str
    text: str  # with its coefficients and shapes by name
    sizes: tuple[tuple[str, str], ...]  # coefficients in which the term is linear, with their units
    shapes: tuple[Shape, ...] = ()
    per_log: bool = False  # whether every log has coefficients of its own, as the phase of a wave has

    @property
    def dry(self) -> bool:
        """Whether it also holds at rest."""
        return DIRECTION in self.text

    @property
    def key(self) -> str:
        """What tells it from other terms."""
        return f"{self.port}: {self.text} {[s.value for s in self.shapes]}"


class Range(NamedTuple):
    """What the logs cover: least, greatest value and quantiles of the magnitude of each variable."""

    low: dict[str, float]
    high: dict[str, float]
    widths: dict[str, tuple[float, ...]]


def range_of(values: Mapping[str, np.ndarray]) -> Range:
    """Ranges of variables from their values."""
    widths = {n: tuple(map(float, np.unique(np.quantile(np.abs(v), WIDTHS)))) for n, v in values.items()}
    return Range({n: float(v.min()) for n, v in values.items()}, {n: float(v.max()) for n, v in values.items()}, widths)


# ---- the library


def terms(plant: Nameplate, covered: Range) -> list[Term]:
    """Every term that may act on a plant's ports, as far as the logs cover what it depends on."""
    angles, rates = [c.q for c in plant.coordinates], [c.dq for c in plant.coordinates]
    found = []
    for port in distinct(plant):
        weights = dict(zip(angles, port.weights, strict=True))
        angle, speed = signed(weights), signed({f"d{n}": w for n, w in weights.items()})
        own_rates = list(dict.fromkeys([speed, *rates]))
        found += [Term(port.name, text, (("size", unit(powers)),), shapes) for text, powers, shapes in (
            *constant(), *of_rates(own_rates, covered), *dry(speed, covered), *of_angles([angle, *angles]),
            *products(own_rates, angles), *of_time(speed))]  # fmt: skip
        found += waves(port.name, angle, covered)
        found += bumps(port.name, angle, covered)
        if len([w for w in weights.values() if w]) > 1:
            found += [Term(port.name, t, (("size", unit(p)),), s) for t, p, s in of_input(plant.input, speed)]
    return list({t.key: t for t in found}.values())


def distinct(plant: Nameplate) -> list[Place]:
    """Ports along coordinates of their own: of several along the same one, the first."""
    return list({port.weights: port for port in reversed(plant.ports)}.values())[::-1]


RATE, ANGLE, VOLT = {"rad": 1, "s": -1}, {"rad": 1}, {"V": 1}
Spec = tuple[str, dict[str, int], tuple[Shape, ...]]


def times(*powers: Mapping[str, int]) -> dict[str, int]:
    """Powers of the units of a product."""
    names = sorted({n for p in powers for n in p})
    return {n: sum(p.get(n, 0) for p in powers) for n in names}


def unit(powers: Mapping[str, int]) -> str:
    """Unit of a coefficient that turns something with these powers of V, s and rad into V, as in V s²/rad²."""
    wanted = {n: (n == "V") - powers.get(n, 0) for n in ("V", "s", "rad")}
    above = " ".join(n + raised(p) for n, p in wanted.items() if p > 0) or "1"
    below = [n + raised(-p) for n, p in wanted.items() if p < 0]
    return above + ("" if not below else f"/{below[0]}" if len(below) == 1 else f"/({' '.join(below)})")


def raised(power: int) -> str:
    """A power as people write it, nothing for 1."""
    return "" if power == 1 else str(power).translate(str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹"))


def bracketed(name: str) -> str:
    """A name, or a combination in brackets."""
    return f"({name})" if " " in name else name


def constant() -> Iterator[Spec]:
    """The same force always."""
    yield "size", {}, ()


def of_rates(rates: Sequence[str], covered: Range) -> Iterator[Spec]:
    """Drags that grow with a power of a rate, and smooth signs."""
    for name in rates:
        x = bracketed(name)
        yield f"size*{x}", RATE, ()
        yield f"size*abs({name})", RATE, ()
        yield f"size*{x}*abs({name})", times(RATE, RATE), ()
        yield f"size*{x}^2", times(RATE, RATE), ()
        yield f"size*{x}^3", times(RATE, RATE, RATE), ()
        for width in covered.widths.get(name, ()):
            yield f"size*tanh({x}/width)", {}, (Shape("width", "rad/s", width, 0.02 * width),)


def dry(speed: str, covered: Range) -> Iterator[Spec]:
    """Dry friction, and dry friction that falls with speed."""
    yield f"size*{DIRECTION}", {}, ()
    for width in covered.widths.get(speed, ()):
        yield (f"size*{DIRECTION}*exp(-({bracketed(speed)}/width)^2)", {},
               (Shape("width", "rad/s", width, 0.02 * width),))  # fmt: skip


def of_angles(angles: Sequence[str]) -> Iterator[Spec]:
    """Springs."""
    for name in angles:
        x = bracketed(name)
        yield f"size*{x}", ANGLE, ()
        yield f"size*{x}*abs({name})", times(ANGLE, ANGLE), ()
        yield f"size*{x}^3", times(ANGLE, ANGLE, ANGLE), ()


def products(rates: Sequence[str], angles: Sequence[str]) -> Iterator[Spec]:
    """Drags that depend on another rate or on an angle."""
    for name in rates:
        x = bracketed(name)
        for other in rates:
            if other != name:
                yield f"size*{x}*abs({other})", times(RATE, RATE), ()
        for angle in angles:
            yield f"size*{x}*abs({angle})", times(RATE, ANGLE), ()
            yield f"size*{x}*{angle}", times(RATE, ANGLE), ()


def of_time(speed: str) -> Iterator[Spec]:
    """Forces that grow while the log runs."""
    yield "size*t", {"s": 1}, ()
    yield f"size*{bracketed(speed)}*t", times(RATE, {"s": 1}), ()


def of_input(name: str, speed: str) -> Iterator[Spec]:
    """What a motor or driver makes of the voltage, and friction that grows with the load."""
    x = bracketed(speed)
    yield f"size*abs({name})", VOLT, ()
    yield f"size*{name}*abs({name})", times(VOLT, VOLT), ()
    yield f"size*{name}^3", times(VOLT, VOLT, VOLT), ()
    yield f"size*{name}*t", times(VOLT, {"s": 1}), ()
    yield f"size*{name}*abs({speed})", times(VOLT, RATE), ()
    yield f"size*{x}*abs({name})", times(VOLT, RATE), ()
    yield f"size*abs({name})*sign({speed})", VOLT, ()


def waves(port: str, angle: str, covered: Range) -> list[Term]:
    """Ripples that repeat over a turn of a port, where the logs turn far enough to tell."""
    x = bracketed(angle)
    reach = covered.high.get(angle, 0.0) - covered.low.get(angle, 0.0)
    return [
        Term(port, f"sine*sin({n}*{x}) + cosine*cos({n}*{x})", (("sine", "V"), ("cosine", "V")), per_log=True)
        for n in TURNS if n * reach > WAVE
    ]  # fmt: skip


def bumps(port: str, angle: str, covered: Range) -> list[Term]:
    """Pushes at a place."""
    low, high = covered.low.get(angle, 0.0), covered.high.get(angle, 0.0)
    if high - low < 0.5:
        return []
    return [
        Term(port, f"size*exp(-(({angle} - place)/width)^2)", (("size", "V"),),
             (Shape("place", "rad", float(place), None), Shape("width", "rad", share * (high - low),
                                                              0.01 * (high - low))))
        for share in BROAD for place in np.linspace(low, high, PLACES)
    ]  # fmt: skip


# ---- numbers


def values_of(term: Term, motion: Mapping[str, np.ndarray], plant: Nameplate) -> np.ndarray:
    """What multiplies each coefficient (N, sizes) along a motion, from the very text of the term."""
    rates = [c.dq for c in plant.coordinates]
    slip = sum(w * motion[n] for w, n in zip(plant.port(term.port).weights, rates, strict=True))
    known = {**{n: v for n, v in motion.items() if n.isidentifier()}, DIRECTION: np.sign(slip)}
    columns = [function(*(known[n] for n in inputs)) for inputs, function in compiled(term, tuple(known))]
    return np.column_stack([np.broadcast_to(np.asarray(c, dtype=float), np.shape(slip)) for c in columns])


@lru_cache(maxsize=4096)
def compiled(term: Term, known: tuple[str, ...]) -> tuple[tuple[tuple[str, ...], Callable], ...]:
    """For each coefficient the inputs, and the function of them, that multiply it."""
    from derive.grammar import read

    names = [*known, *(n for n, _ in term.sizes), *(s.name for s in term.shapes)]
    expression = read(term.text, {n: symbol(n) for n in names})
    expression = expression.subs({symbol(s.name): s.value for s in term.shapes})
    found = []
    for size, _ in term.sizes:
        column = expression.diff(symbol(size))
        inputs = tuple(n for n in known if column.has(symbol(n)))
        found.append((inputs, sp.lambdify([symbol(n) for n in inputs], column, NUMERIC)))
    return tuple(found)


def directions_of(term: Term, plant: Nameplate) -> np.ndarray:
    """How a term acts on each row (sizes, rows): a resistance opposes its port."""
    return np.tile(-np.array(plant.port(term.port).weights), (len(term.sizes), 1))
