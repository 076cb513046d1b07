"""Refitting a model with one effect more, as diagnosis does it, for an effect that the user names."""

from __future__ import annotations

from wheelpend.diagnosis import SHORT, refit
from wheelpend.screening import ripple_shape, screen
from wheelpend.shooting import Fit
from wheelpend.study import Study, fit_model, free_names, shortened


def refit_with(study: Study, start: dict[str, float], base: Fit, effect: str) -> Fit:
    """Fit the study's model plus one effect from the sizes that the screening suggests."""
    present = study.model.effects
    short = fit_model(study, start, free_names(study, present), horizons=(SHORT,))
    ripple = ripple_shape(study, short) if effect == "cogging" else (1.0, 1)
    near = screen(study, short, shortened(study, SHORT * study.horizon), present, ripple)
    far = screen(study, base, study.training, present, ripple)
    candidates = [c for s in (near, far) for c in s.candidates if c.effect.name == effect]
    begun = refit(study, short, start, candidates)
    return fit_model(study, begun.values, free_names(study, [*present, effect]), horizons=(1.0,),
                     start_per_log=begun.per_log)  # fmt: skip
