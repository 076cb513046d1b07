"""Random sources that identification left in a model file."""

from __future__ import annotations

from collections.abc import Sequence

from wheelpend.estimation.random_source import RandomSource, Sources, all_errors, possible_forces
from wheelpend.model.record import Model


def stored_sources(model: Model, outputs: Sequence[str]) -> Sources:
    """Forces of [random_force] and errors of [sensor_error]; none where the file has neither."""
    plant = model.plant_signature
    rows = {c.row: n for n, c in enumerate(plant.coordinates)}
    found: dict[str, RandomSource] = {}
    for source in possible_forces(plant, len(outputs)):
        for row, force in model.random_force.items():
            weight = abs(source.rows[rows[row]])
            if weight and source.place == (force.place or row):
                found.setdefault(source.place, source.with_noise(force.rms / weight, force.correlation_time))
    errors = [
        source.with_noise(error.rms, error.lag or error.correlation_time)
        for source in all_errors(outputs, len(rows))
        for channel, error in model.sensor_error.items()
        if source.place == channel and source.lags == bool(error.lag)
    ]
    return (*found.values(), *errors)
