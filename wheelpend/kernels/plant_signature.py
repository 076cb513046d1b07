"""Plant signatures (names, units and numbers of a plant) from the cache, so that SymPy loads only to derive."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

from derive import plants
from derive.plant_signature import PlantSignature
from wheelpend.kernels.cache import cached_text


def plant_signature(plant: str, assumptions: Mapping) -> PlantSignature:
    """Coordinates, ports, channels, constants and input of a plant under settled assumptions."""
    return _parse_signature(
        cached_text("plate", plant, sorted(assumptions.items()), lambda: _signature_json(plant, assumptions))
    )


def _signature_json(plant: str, assumptions: Mapping) -> str:
    return plants.build(plant, assumptions).plant_signature.to_json()


_parse_signature = lru_cache(PlantSignature.from_json)
