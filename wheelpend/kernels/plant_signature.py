"""What a plant has, in names, units and numbers: kept, so that SymPy is only needed where something is derived."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

from derive.plant_signature import Nameplate

from derive import plants
from wheelpend.kernels.cache import cached_text


def plant_signature(plant: str, assumptions: Mapping) -> Nameplate:
    """What a plant has under settled assumptions."""
    return _parse_signature(
        cached_text("plate", plant, sorted(assumptions.items()), lambda: _signature_json(plant, assumptions))
    )


def _signature_json(plant: str, assumptions: Mapping) -> str:
    return plants.build(plant, assumptions).plant_signature.to_json()


_parse_signature = lru_cache(Nameplate.from_json)
