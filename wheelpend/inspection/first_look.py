"""The first look at a log, before there is a model: its columns, the model they suggest, and what that finds in it."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from derive import plants
from wheelpend.errors import Failure
from wheelpend.inspection.inspect import Inspection, inspect_file
from wheelpend.inspection.plant_fit import toml_value
from wheelpend.inspection.proposal import Proposal, propose, with_cures
from wheelpend.inspection.signals import is_whole
from wheelpend.inspection.survey import Survey, survey_file
from wheelpend.logs.columns import ColumnTable
from wheelpend.logs.log import Log
from wheelpend.model.record import Model
from wheelpend.model.toml_checks import call_look_up

TURNING_ENCODER = '[sensors]\nencoder = "relative"\n'
TURNING_REASON = "counts are read against the body, with which the housing turns; absolute where the pitch was added"


class FirstLook(NamedTuple):
    """What a log says without a model."""

    survey: Survey
    proposal: Proposal
    model: str  # the text of a model.toml, with the cures of what was found
    log: Log | None  # as that model reads it, and what it finds in it
    inspection: Inspection | None
    refusal: str  # why it cannot be read so; empty where it can
    guesses: Mapping[str, str] = {}  # why quantities are read as they are, where only numbers say so

    def to_json(self) -> dict[str, Any]:
        """The result under the keys of JSON: those of an inspection, with columns, plants and model."""
        found = self.inspection.to_json() if self.inspection else {}
        return found | {
            "columns": self.survey.columns,
            "plants": self.proposal.plants,
            "sentences": self.proposal.sentences,
            "model": self.model,
            "refusal": self.refusal or None,
            "guesses": self.guesses,
        }


def first_look(path: Path, plant: str = "", interval: float | None = None) -> FirstLook:
    """Look at a log without a model, or for a plant only; raises Failure where no plant has its columns.

    ``interval`` [s] is that from row to row, of a log whose times are missing or of no use.
    """
    if plant:
        call_look_up(plants.find, plant)
    survey = survey_file(path, interval)
    proposal = propose(survey, plant)
    try:
        log, inspection = inspect_file(Model.parse(proposal.text), path)
        if untold := [f.channel for f in inspection.findings if f.kind == "counts" and not f.size]:
            proposal = propose(survey, plant, untold)
            log, inspection = inspect_file(Model.parse(proposal.text), path)
    except Failure as failure:
        return FirstLook(survey, proposal, proposal.text, None, None, str(failure), proposal.guesses)
    guesses = {**proposal.guesses, **estimates(inspection)}
    cured, sensors = with_cures(proposal.text, inspection.proposal), inspection.sensors
    turning = counts_turn_with_the_body(survey, cured, inspection, path)
    if turning:
        cured, guesses = with_cures(cured, TURNING_ENCODER), guesses | {"encoder": TURNING_REASON}
    if inspection.proposal or turning:
        as_cured, again = inspect_file(Model.parse(cured), path)
        log, sensors = replace(log, warnings=as_cured.warnings), again.sensors  # of what the cures leave
    comments = {**guesses, **counts_comments(guesses, Model.parse(cured).table)}
    text = with_cures(cured, steps_text(sensors), guesses=comments)  # steps in the unit that the cures give a channel
    return FirstLook(survey, proposal, text, log, inspection, "", guesses)


def counts_turn_with_the_body(survey: Survey, text: str, inspection: Inspection, path: Path) -> bool:
    """True of an encoder in counts on a body that leans, where the equations do not tell what it is read against.

    Its housing is the motor's, which turns with the body; only a reading to which the pitch was added is not so.
    """
    model = Model.parse(text)
    counted = (c for c, s in model.table.sensors.items() if s.counts_key and c in model.columns)
    whole = [c for c in counted if is_whole(survey.values.get(model.columns[c].column, np.zeros(1)))]
    if model.assumptions.get("encoder") != "absolute" or not whole:
        return False
    if any(f.kind in ("relative_encoder", "absolute_encoder") for f in inspection.findings):
        return False
    _, turned = inspect_file(Model.parse(with_cures(text, TURNING_ENCODER)), path)
    return not any(f.kind == "absolute_encoder" for f in turned.findings)


def estimates(inspection: Inspection) -> dict[str, str]:
    """Why a channel is read in a scale that was estimated, which its user should replace by the exact one."""
    found = {}
    for finding in inspection.findings:
        if finding.kind == "counts" and finding.size:
            turn = 2 * math.pi * finding.size
            found[finding.channel] = f"about {turn:.4g} counts to a turn by the equations; put 2 pi / the exact number"
        elif finding.kind == "wrong_unit" and "exact ratio" in finding.cure:
            found[finding.channel] = f"1 / {finding.size:.4g} by the equations; put 1 / the exact ratio"
    return found


def counts_comments(guesses: Mapping[str, str], table: ColumnTable) -> dict[str, str]:
    """Why an encoder's counts in [sensors] are what they are, where the scale of its channel is a guess."""
    keys = {c: table.sensors[c].counts_key for c in guesses if c in table.sensors and table.sensors[c].counts_key}
    return {key: f"with the scale of {channel}; put the exact number here too" for channel, key in keys.items()}


def steps_text(sensors: str) -> str:
    """The sensors' steps and counts of a section [sensors], without the noises, which are found anew in each log."""
    found = tomllib.loads(sensors).get("sensors", {})
    counts = [f"{k} = {v}" for k, v in found.items() if isinstance(v, int)]
    steps = [f"{k} = {toml_value(v)}" for k, v in found.get("step", {}).items()]
    return "\n".join(["[sensors]", *counts, *(["[sensors.step]", *steps] if steps else [])])
