"""Several models beside each other: labels, which of them can be judged on the same logs, and the errors of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from wheelpend.diagnosis.horizons import HorizonError
from wheelpend.errors import Failure
from wheelpend.model.record import Model

OWN_LABEL = "this model"  # of the model that others are compared with


@dataclass(frozen=True)
class ModelErrors:
    """How well a model predicts the logs of a comparison, by their σ and over their segments."""

    label: str
    error: float  # [σ]
    fit_percent: dict[str, float]  # by channel
    rmse: dict[str, float]  # by channel, in its unit
    horizons: tuple[HorizonError, ...]
    fitted_first: bool  # the model had no values and was fitted to the logs

    def to_json(self) -> dict[str, Any]:
        """The errors under the keys of JSON."""
        return {
            "model": self.label,
            "error": self.error,
            "fit_percent": self.fit_percent,
            "rmse": self.rmse,
            "horizons": self.horizons,
            "fitted_first": self.fitted_first,
        }


def labelled_models(model: Model, against: Model | Sequence[Model] | Mapping[str, Model]) -> dict[str, Model]:
    """Other models by label: the one that is given, else the path of the file, else a number.

    Raises Failure for what is no model, and for a model of another plant or with other channels than ``model``.
    """
    if isinstance(against, Mapping):
        found = {str(label): other for label, other in against.items()}
    else:
        found = {}
        for number, other in enumerate([against] if isinstance(against, Model) else against, 2):
            label = str(getattr(other, "path", None) or f"model {number}")
            found[f"{label} ({number})" if label in found else label] = other
    for label, other in found.items():
        _check_comparable(model, label, other)
    return found


def _check_comparable(model: Model, label: str, other: Any) -> None:
    if not isinstance(other, Model):
        raise Failure(f"{label}: what a model is compared with must be a Model, not {type(other).__name__}. "
                      "Open it with Model.open(path).")  # fmt: skip
    if other.plant != model.plant:
        raise Failure(f"{label}: models that are compared must be of one plant, but this one is of {other.plant}, the "
                      f"first of {model.plant}. Compare it with logs of its own machine.")  # fmt: skip
    if (other.table.inputs, other.table.channels) != (model.table.inputs, model.table.channels):
        raise Failure(f"{label}: models that are compared must read the same inputs and channels, but this one reads "
                      f"{', '.join((*other.table.inputs, *other.table.channels))}, the first "
                      f"{', '.join((*model.table.inputs, *model.table.channels))}.")  # fmt: skip
