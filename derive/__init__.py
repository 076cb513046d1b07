"""From the geometry of a machine to the text of its kernels.

Each stage is a function from one frozen record to the next:

1. ``plants.<name>.build``          assumptions  → Plant       geometry, loads, sensors as stated
2. ``lagrange.derive_equations``    Plant        → Equations   Lagrangian, equations of motion
3. ``grouping.group``               Equations    → Grouping    equivalent parameters X1, X2, ... and rows in them
4. ``model.compose``                + effects    → Model       residual per row, dry surfaces, sensor readings
5. ``regressor.derive_regressor``   Model        → Regressor   tau = phi X and the split without accelerations
6. ``statespace.generate_code``     Model        → Code        kernels as strings: here SymPy ends
7. ``emit.render``                  Code         → text        the templates format it

Beside them, ``equivalence.relations`` finds what no data can tell apart: effects that are part of X1, X2, ..., twins,
and effects that contain others.

Nothing behind stage 1 knows a particular machine; a new machine is one file in ``plants``, a new effect one row in
``effects``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import sympy as sp

from derive import effects, plants
from derive.effects import Deformation, InnerForce, InnerPlay
from derive.emit import differences, equations_text, render, write
from derive.equivalence import relations
from derive.grouping import NotExpressibleError
from derive.model import compose
from derive.records import Model


def model_files(plant: str, assumptions: dict, effect_names: Sequence[str]) -> dict[str, str]:
    """The generated files of a workspace: the model's own module and the library's, which holds every effect."""
    lean = compose(plant, assumptions, effect_names)
    return {
        "__init__.py": '"""Kernels generated from model.toml by `wheelpend generate`."""\n',
        f"{plant}.py": render(lean),
        f"{plant}_library.py": render(library_model(plant, assumptions), title=f"{plant} with every effect"),
    }


def library_model(plant: str, assumptions: dict, own: Sequence[str] = (), free: Sequence[str] = ()) -> Model:
    """The model with every effect that the plant and its assumptions allow, and a missing force on each row.

    ``own`` are names of a user's registered effects. Effects that free something inside the machine cannot be absent
    while it is free: only those are in it that free what is named in ``free``.

    Effects that are part of the plant's own parameters are left out, and named among the relations.
    """
    settled = plants.settle(plant, assumptions)
    fitting = effects.possible_on(plants.build(plant, settled), own)
    possible = [e for e in fitting if (not e.frees or e.frees in free) and derivable(plant, settled, e)]
    found = relations(plant, settled, [e.name for e in possible])
    chosen = [e.name for e in possible if e.full_names[0] not in found.absorbed]
    return replace(compose(plant, settled, chosen, missing_force=True), relations=found)


def derivable(plant: str, assumptions: dict, effect: effects.Effect) -> bool:
    """Whether an effect can be written with the plant's parameters and constants under these assumptions."""
    if not isinstance(effect.enters, Deformation | InnerForce | InnerPlay):
        return True
    try:
        found = compose(plant, assumptions, [effect.name])
    except NotExpressibleError:
        return False
    accelerations = [c.ddq for c in found.plant.moving]
    return sp.Matrix(found.residual).jacobian(accelerations).det() != 0  # a give without inertia is none


__all__ = [
    "compose",
    "derivable",
    "differences",
    "effects",
    "equations_text",
    "library_model",
    "model_files",
    "plants",
    "relations",
    "render",
    "write",
]
