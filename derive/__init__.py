"""From the geometry of a machine to the text of its kernels.

Each stage is a function from one frozen record to the next:

1. ``plants.<name>.build``          assumptions  → Plant       geometry, loads, sensors as stated
2. ``lagrange.derive_equations``    Plant        → Equations   Lagrangian, equations of motion
3. ``grouping.group_parameters``    Equations    → Grouping    equivalent parameters X1, X2, ... and rows in them
4. ``model.compose``                + effects    → Model       residual per row, dry surfaces, sensor readings,
                                                               by ``base_equations`` and ``effect_laws``
5. ``regressor.derive_regressor``   Model        → Regressor   tau = phi X and the split without accelerations
6. ``statespace.generate_code``     Model        → Code        kernels as strings, by ``kernels``: here SymPy ends
7. ``emit.render``                  Code         → text        the templates format it

Beside them, ``equivalence.relations`` finds the effects that no log can distinguish: parts of X1, X2, ..., twins, and
effects within others.

``library.library_model`` is a plant with every applicable effect.

Nothing behind stage 1 knows a particular machine; a new machine is one file in ``plants``, a new effect one row in
``effects``.

What is imported here is light: rows of effects and what plants state. The stages, and SymPy with them, are loaded when
one is first used, because most commands find in the cache all that was ever derived.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from derive import effects, plants
from derive.files import differences, write

if TYPE_CHECKING:
    from derive.emit import equations_text, render
    from derive.equivalence import relations
    from derive.library import library_model
    from derive.model import compose
    from derive.records import Model

_MODULE_BY_NAME = {
    "Model": "records",
    "compose": "model",
    "equations_text": "emit",
    "library_model": "library",
    "relations": "equivalence",
    "render": "emit",
}


def __getattr__(name: str) -> Any:
    if name not in _MODULE_BY_NAME:
        raise AttributeError(f"module 'derive' has no attribute '{name}'")
    return getattr(import_module(f"derive.{_MODULE_BY_NAME[name]}"), name)


__all__ = [
    "Model",
    "compose",
    "differences",
    "effects",
    "equations_text",
    "library_model",
    "plants",
    "relations",
    "render",
    "write",
]
