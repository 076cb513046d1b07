"""The plants: one file each, stating geometry, actuator, sensors and assumptions."""

from __future__ import annotations

from types import ModuleType

from derive.plants import wheel_pendulum

PLANTS: dict[str, ModuleType] = {wheel_pendulum.NAME: wheel_pendulum}


def find(name: str) -> ModuleType:
    """Return the plant's module; raises KeyError naming the known plants."""
    if name not in PLANTS:
        raise KeyError(f"No plant named '{name}'. Known plants: {', '.join(sorted(PLANTS))}")
    return PLANTS[name]


def brought(name: str, assumptions: dict) -> tuple[str, ...]:
    """Effects that settled assumptions stand for."""
    pairs = ((a.name, choice, effect) for a in find(name).ASSUMPTIONS for choice, effect in a.brings)
    return tuple(effect for key, choice, effect in pairs if assumptions[key] == choice)


def settle(name: str, assumptions: dict) -> dict:
    """Fill in the defaults of a plant's assumptions and check what was given."""
    known = {a.name: a for a in find(name).ASSUMPTIONS}
    for key, value in assumptions.items():
        if key not in known:
            raise KeyError(f"No assumption named '{key}' in {name}. Known assumptions: {', '.join(sorted(known))}")
        if not any(value is c or (type(value) is type(c) and value == c) for c in known[key].choices):
            raise KeyError(f"Assumption {key} must be one of {list(known[key].choices)}, not {value!r}")
    return {a.name: assumptions.get(a.name, a.default) for a in known.values()}
