"""The first look at a log, before there is a model: its columns, the model they suggest, and what that finds in it."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any, NamedTuple

from wheelpend.errors import Failure
from wheelpend.inspection.inspect import Inspection, inspect_file
from wheelpend.inspection.plant_fit import toml_value
from wheelpend.inspection.proposal import Proposal, propose, with_cures
from wheelpend.inspection.survey import Survey, survey_file
from wheelpend.logs.log import Log
from wheelpend.model.record import Model


class FirstLook(NamedTuple):
    """What a log says without a model."""

    survey: Survey
    proposal: Proposal
    model: str  # the text of a model.toml, with the cures of what was found
    log: Log | None  # as that model reads it, and what it finds in it
    inspection: Inspection | None
    refusal: str  # why it cannot be read so; empty where it can

    def to_json(self) -> dict[str, Any]:
        """The result under the keys of JSON: those of an inspection, with columns, plants and model."""
        found = self.inspection.to_json() if self.inspection else {}
        return found | {
            "columns": self.survey.columns,
            "plants": self.proposal.plants,
            "sentences": self.proposal.sentences,
            "model": self.model,
            "refusal": self.refusal or None,
        }


def first_look(path: Path, plant: str = "") -> FirstLook:
    """Look at a log without a model, or for a plant only; raises Failure where no plant has its columns."""
    survey = survey_file(path)
    proposal = propose(survey, plant)
    try:
        log, inspection = inspect_file(Model.parse(proposal.text), path)
    except Failure as failure:
        return FirstLook(survey, proposal, proposal.text, None, None, str(failure))
    text = with_cures(proposal.text, inspection.proposal, steps_text(inspection.sensors))
    return FirstLook(survey, proposal, text, log, inspection, "")


def steps_text(sensors: str) -> str:
    """The sensors' steps and counts of a section [sensors], without the noises, which are found anew in each log."""
    found = tomllib.loads(sensors).get("sensors", {})
    counts = [f"{k} = {v}" for k, v in found.items() if isinstance(v, int)]
    steps = [f"{k} = {toml_value(v)}" for k, v in found.get("step", {}).items()]
    return "\n".join(["[sensors]", *counts, *(["[sensors.step]", *steps] if steps else [])])
