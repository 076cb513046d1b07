"""Refitting a model with one effect more, as diagnosis does it, for an effect that the user names."""

from __future__ import annotations

import derive
from wheelpend.diagnosis import EXPLAINED, SHORT, near_screens, refit, starts_for
from wheelpend.shapes import shapes_of
from wheelpend.shooting import Fit
from wheelpend.study import Study, fit_model, free_names


def refit_with(study: Study, start: dict[str, float], base: Fit, effect: str) -> Fit:
    """Fit the study's model plus one effect from the sizes that the screening suggests."""
    present = study.model.effects
    short = fit_model(study, start, free_names(study, present), horizons=(SHORT,))
    shapes = shapes_of(study, short, [derive.effects.find(effect)])
    near = near_screens(study, short, start, shapes, corrupted=base.error > EXPLAINED * study.floor)
    begun = refit(study, short, starts_for(near, effect))
    return fit_model(study, begun.values, free_names(study, [*present, effect]), horizons=(1.0,),
                     start_per_log=begun.per_log)  # fmt: skip
