"""What a plant has, in names, units and numbers: kept, so that SymPy is only needed where something is derived."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

from derive import plants
from derive.nameplate import Nameplate
from wheelpend.kernels.cache import kept


def nameplate(plant: str, assumptions: Mapping) -> Nameplate:
    """What a plant has under settled assumptions."""
    return _read(kept("plate", plant, sorted(assumptions.items()), lambda: _text(plant, assumptions)))


def _text(plant: str, assumptions: Mapping) -> str:
    return plants.build(plant, assumptions).nameplate.to_json()


_read = lru_cache(Nameplate.from_json)
