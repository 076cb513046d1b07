"""What a model leaves to chance, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wheelpend.model.units import plant_units_of
from wheelpend.reports.numbers import digits_text, is_number, range_text, share_text, time_text

if TYPE_CHECKING:
    from wheelpend.diagnosis.likelihood.resonance import Resonance
    from wheelpend.identification.remainder import Remainder, RowForce, SensorError
    from wheelpend.identification.widening import Widening
    from wheelpend.model.record import Model

LEFT_TO_CHANCE = "Left to chance"  # begins the sentences on random forces
NOT_SEARCHED = "before any {}effect was looked for"  # by `compare`, `residuals` and `identify`
NOT_ADDED = "before any {}effect is added"  # of a diagnosis that names some
NEGLIGIBLE_SHARE = 1e-3  # of the drive, below which a random force means nothing for the machine
MIN_TOLD_SIGMAS = 0.1  # of a sensor, an error of its own that says more than its lag
MIN_TOLD_WIDENING = 1.5  # times, from which on it is said that an interval is wider


def leaves_a_force(left: Remainder | None) -> bool:
    """True where a random force is left on the machine."""
    return left is not None and bool(left.force)


def remainder_sentences(left: Remainder | None, model: Model, as_it_stands: str = "") -> list[str]:
    """A sentence or two on each random force and each random error of a sensor; none where nothing is known.

    ``as_it_stands`` (NOT_SEARCHED or NOT_ADDED) says that this is not what remains after a search.
    """
    if left is None:
        return []
    errors = [_sensor_sentence(name, error) for name, error in left.sensors.items()]
    errors += [_resonance_sentence(ring) for ring in left.resonances]
    if not left.force:
        if errors:
            return ["No random force is left: what is not predicted is taken for errors of the sensors.", *errors]
        return ["Nothing is left to chance: sensor noise explains what was fitted."]
    begin = f"{LEFT_TO_CHANCE}{_as_it_stands_text(as_it_stands, model)}:"
    lines, told = list[str](), set[str]()
    for place, rows in _rows_by_force(left):
        row, strongest = max(rows, key=lambda r: r[1].share)
        where = f"on the {row} row in all" if place in told else _place_text(row, strongest, model)
        lines += _force_sentences(strongest, where, model, "And" if lines else begin)
        told.add(place)
    return [*lines, *errors]


def _rows_by_force(left: Remainder) -> list[tuple[str, list[tuple[str, RowForce]]]]:
    """Places of forces in the rows' order, each with the rows that feel the same there, the smallest first.

    Rows of a port feel two sizes where one of them feels a force of its own besides.
    """
    places: dict[str, dict[float, list[tuple[str, RowForce]]]] = {}
    for row, force in left.force.items():
        places.setdefault(force.place, {}).setdefault(force.rms, []).append((row, force))
    return [(place, sizes[rms]) for place, sizes in places.items() for rms in sorted(sizes)]


def _as_it_stands_text(since: str, model: Model) -> str:
    """Of which model it is that a sentence tells, where that is not what remains after a search."""
    return f" by the model as it stands, {since.format('further ' if model.effects else '')}" if since else ""


def _place_text(row: str, force: RowForce, model: Model) -> str:
    port = model.plant_signature.couplings.get(force.place)
    return port.place if port else f"on the {row} row"


def _force_sentences(force: RowForce, place: str, model: Model, begin: str) -> list[str]:
    physical_unit, of_all = plant_units_of(model).physical, model.plant_signature.drive_words
    physical = "" if force.rms_torque is None else f" ({digits_text(force.rms_torque, 3)} {physical_unit})"
    share = f", {share_text(force.share)} of {of_all}" if is_number(force.share) else ""
    negligible = ": negligible" if force.share < NEGLIGIBLE_SHARE else ""
    unit = "" if force.unit == "1" else f" {force.unit}"
    found = (f"{begin} a random force of {digits_text(force.rms, 3)}{unit}{physical}{share}, {place}, "
             f"correlation time {time_text(force.correlation_time_s)}{negligible}.")  # fmt: skip
    if not force.at_bound or negligible:
        return [found]
    return [found, "Its correlation time is the longest that is allowed on this log (1 s, or a twentieth of the log): "
            "what is left is slower than that, so rather a law, an offset or a drift that is missing "
            "than chance."]  # fmt: skip


def _sensor_sentence(name: str, error: SensorError) -> str:
    lag = f"{name} lags by {time_text(error.lag_s)}, as behind a low-pass filter. " if error.lag_s else ""
    if lag and error.sigmas < MIN_TOLD_SIGMAS:
        return lag.strip()
    value, unit = (error.rms * 1e3, f"m{error.unit}") if error.unit in ("rad", "rad/s") else (error.rms, error.unit)
    size = f"{digits_text(value, 2)} {unit} ({digits_text(error.sigmas, 2)} σ)"
    time = f"correlation time {time_text(error.correlation_time_s)}"
    if error.smaller_sigmas:
        other = f"{time_text(error.smaller_time_s)} for {digits_text(error.smaller_sigmas, 2)} σ of it"
        return f"{lag}{name} has two errors of its own, of {size} together, {time}, and {other}: a slow and a fast one."
    return f"{lag}{name} has an error of its own of {size}, {time}: it was filtered, fused or drifts."


def _resonance_sentence(ring: Resonance) -> str:
    sharp = f"damping ratio {digits_text(ring.damping, 2)}" if ring.damping else "too sharp to tell its damping"
    return (f"What is missed of {ring.channel} has a resonance at {digits_text(ring.frequency_hz, 3)} Hz ({sharp}), "
            f"{share_text(ring.share)} of its mean square: something elastic that the model does not have, or a hum."
            )  # fmt: skip


def widening_sentences(widening: Widening | None) -> list[str]:
    """Which intervals are wider because the force's correlation time is an assumption."""
    told = {n: f for n, f in (widening.factors if widening else {}).items() if f >= MIN_TOLD_WIDENING}
    if widening is None or not told:
        return []
    times = f"{range_text(widening.shortest_s, widening.longest_s)} s"
    factors = f"{range_text(min(told.values()), max(told.values()))} times wider"
    one = len(told) == 1
    return [
        f"The {'interval' if one else 'intervals'} of {', '.join(told)} {'is' if one else 'are'} {factors} because "
        f"{'it moves' if one else 'they move'} with the correlation time that is assumed of the force ({times})."
    ]
