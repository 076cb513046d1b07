"""The keys of every JSON result, all of them and no other: programs of others read them."""

import json
import math
import re
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
import pytest

from tests.support import ROOT, SPARSE_S, run, simulated
from wheelpend import Model, save_log
from wheelpend.campaigns.one_log import LogResult
from wheelpend.campaigns.summary import ParameterAgreement, ParameterRecovery, Summary
from wheelpend.diagnosis.evidence import CandidateFit
from wheelpend.diagnosis.explain import Ladder, Step
from wheelpend.diagnosis.missing_force.law_search import FreeLaw
from wheelpend.diagnosis.verdict import Diagnosis
from wheelpend.serialise import dumps, to_json

NAMES = {"X1", "X2", "X3", "X4", "X5", "X6", "X7", "theta_w", "theta_p", "dtheta_p", "v_in"}  # that a model chooses


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("workspace")
    (folder / "model.toml").write_text(Model.default().text, encoding="utf-8")
    save_log(folder / "log.csv", simulated(duration=4.0, sample=SPARSE_S, coulomb_drive__torque=0.3))
    return folder


def keys(value, prefix=""):
    """Every key of a result, with those above it; lists and what a model names itself leave no trace."""
    if isinstance(value, list):
        return {k for v in value for k in keys(v, prefix)}
    found = set()
    for key, inner in value.items() if isinstance(value, dict) else ():
        own = prefix if key in NAMES or "." in key else f"{prefix}.{key}".lstrip(".")
        found |= {own, *keys(inner, own)} - {""}
    return found


def flat(text):
    """Keys written as a b(c d(e)) in words: a, b, b.c, b.d, b.d.e."""
    found, path, last = set(), [], ""
    for word in re.findall(r"[\w]+|[()]", text):
        if word == "(":
            path.append(last)
        elif word == ")":
            path.pop()
        else:
            last = word
            found.add(".".join([*path, word]))
    return found


COMMANDS = {
    "identify log.csv --method filtered --tau 0.1,0.2": """
        schema method parameters(value sigma identifiable) condition_number samples error noise_floor warnings tau hold
        forgetting track guide force_error cutoff_hz bias(p_value biased against difference_percent sigma_percent
        predicted_bias_percent predicted_spread_percent replicas) remainder covariance(names matrix) widening
        fixed at_bounds""",
    "identify log.csv --method shooting": """
        schema method parameters(value sigma identifiable) condition_number samples error noise_floor warnings tau hold
        forgetting track guide force_error cutoff_hz bias remainder covariance(names matrix) widening
        fixed at_bounds""",
    "identify log.csv --method recursive --tau 0.1,0.2": """
        schema method parameters(value sigma identifiable) condition_number samples error noise_floor warnings tau hold
        forgetting track(t parameters) guide force_error cutoff_hz bias(p_value biased against difference_percent
        sigma_percent predicted_bias_percent predicted_spread_percent replicas) remainder covariance(names matrix)
        widening fixed at_bounds""",
    "identify log.csv": """
        schema method parameters(value sigma identifiable) condition_number samples error noise_floor warnings tau hold
        forgetting track guide force_error cutoff_hz bias covariance(names matrix)
        remainder(force sensors places repeatable_share repeating resonances slow impossible instead unpredicted)
        widening(factors correlation_times_s) fixed at_bounds""",
    "residuals log.csv": """
        schema channels(white whiteness_p independent_of_input_p sigma_ratio sigma_assumed quantised kurtosis lags_s
        autocorrelation band quantiles samples) fitted_first warnings
        remainder(force sensors places repeatable_share repeating resonances slow impossible instead unpredicted)""",
    "compare log.csv": """
        schema error noise_floor horizon_s fit_percent rmse horizons(seconds error diverged) fitted_first warnings
        closed_loop(rmse rmse_input diverged) where(row state from to share) force_error bursts per_log residuals
        remainder(force sensors places repeatable_share repeating resonances slow impossible instead unpredicted)
        against""",
    "compare log.csv --against model.toml": """
        schema error noise_floor horizon_s fit_percent rmse horizons(seconds error diverged) fitted_first warnings
        closed_loop(rmse rmse_input diverged) where(row state from to share) force_error bursts per_log residuals
        remainder(force sensors places repeatable_share repeating resonances slow impossible instead unpredicted)
        against(model error fit_percent rmse horizons(seconds error diverged) fitted_first)""",
    "export json": """
        schema target plant effects error error_in_target replayed notes""",
    "inspect log.csv": """
        schema samples duration_s rate_hz jitter gaps(count longest) findings proposal sensors stand_still
        channels(minimum maximum noise quantum missing)""",
    "split log.csv --from 1 --to 2": "schema log rest held_out from_s to_s samples(rest held_out) left_out",
    "add coulomb_drive --data log.csv": """
        schema effect coefficients(torque) sigma(torque) unit(torque) error_before error_after per_log blocks_agree
        effects noise_floor horizon_s parameters(value sigma)
        remainder(force sensors places repeatable_share repeating resonances slow impossible instead unpredicted)
        warnings""",
    "remove coulomb_drive": "schema effect effects error_before error_after",
    "history": "schema history(change error_before error_after logs)",
    "effects slope": "schema effects(effect family sentence equation means parameters(name unit scope))",
}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_writes_these_keys_and_no_other(command, folder, monkeypatch):
    monkeypatch.chdir(folder)
    model = Model.default().with_effects(["coulomb_drive"] if command.startswith("remove") else [])
    (folder / "model.toml").write_text(model.text, encoding="utf-8")
    entry = {"change": "add slope", "error_before": None, "error_after": None, "logs": []}
    (folder / "history.json").write_text(json.dumps([entry]), encoding="utf-8")
    data = json.loads(run(*command.split(), "--json", "-").stdout)
    left = ("remainder.force.", "remainder.sensors.", "residuals.", "files")  # by row, channel and file
    assert {k for k in keys(data) if not k.startswith(left)} == flat(COMMANDS[command])
    assert data["schema"] == 1


def test_a_changes_parameters_are_those_that_were_fitted(folder, monkeypatch):
    monkeypatch.chdir(folder)
    (folder / "model.toml").write_text(Model.default().text, encoding="utf-8")
    data = json.loads(run("add", "coulomb_drive", "--data", "log.csv", "--json", "-").stdout)
    assert data["parameters"]["X6"]["value"] == pytest.approx(0.7268, rel=0.01)  # nominal is a tenth less
    assert data["parameters"]["coulomb_drive.torque"]["value"] == pytest.approx(0.3, rel=0.02)
    assert data["noise_floor"] == pytest.approx(1.0, abs=0.02) and data["error_before"] > 5.0 > data["error_after"]


RECORDS = {
    Diagnosis: """
        schema verdict horizon_s error noise_floor fit_percent candidates experiment detectable where not_judged
        warnings missing law remainder structures steps error_with_steps""",
    CandidateFit: """
        schema effect family coefficients sigma unit p_value blocks_agree error_after equivalent_to physical beyond
        per_log p_discovery p_confirmation held_out_gain in_sample_gain probability""",
    Ladder: """
        schema verdict nominal_error base_error steps effects error noise_floor horizon_s parameters experiment warnings
        missing law remainder structures""",
    Step: """
        schema effect coefficients sigma unit p_value equivalent_to error_before error_after parameters per_log
        blocks_agree held_out_gain force_before force_after probability""",
    LogResult: """
        schema log seed failure verdict named effects error error_after noise_floor fit_percent parameters covariance
        warnings unit date conditions""",
    Summary: """
        schema logs failed error error_after effects parameters disagreeing unexplained verdicts named hidden found
        first_right false_alarms""",
    ParameterRecovery: "schema logs truth mean bias bias_sigma spread sigma inside",
    ParameterAgreement: "schema logs mean mean_sigma spread sigma chi_square degrees p_value furthest",
}


@pytest.mark.parametrize("record", RECORDS, ids=lambda r: r.__name__)
def test_a_record_is_written_with_these_keys_and_no_other(record):
    empty = record(**{f.name: {} if f.name == "estimates" else None for f in fields(record)})
    assert set(to_json(empty)) == flat(RECORDS[record])


@pytest.mark.parametrize(("place", "record"), [("unexplained.md", FreeLaw)])
def test_a_record_has_the_keys_of_its_page(place, record):
    text = (ROOT / "docs" / place).read_text(encoding="utf-8")
    (line,) = (line for line in text.splitlines() if line.startswith("JSON: `law`"))
    documented = set(re.findall(r"`(\w+)`", line)) - {"law"}
    assert set(to_json(record(**{f.name: None for f in fields(record)}))) - {"schema"} == documented


class Span(NamedTuple):
    low: float
    high: float

    def to_json(self):
        return {"from": self.low, "to": self.high}


@dataclass(frozen=True)
class Sample:
    numbers: tuple
    span: Span
    hidden: float = 1.0

    def to_json(self):
        return {"numbers": self.numbers, "span": self.span}


def test_numbers_are_strict_and_what_is_no_number_is_null():
    data = to_json(Sample((np.float64(1.5), np.int64(2), np.bool_(True), math.nan), Span(-math.inf, np.float32(0.5))))
    assert data == {"schema": 1, "numbers": [1.5, 2, True, None], "span": {"from": None, "to": 0.5}}
    assert [type(v) for v in data["numbers"][:3]] == [float, int, bool]
    assert json.loads(dumps(data)) == data
    with pytest.raises(ValueError, match="Out of range"):
        dumps({"a": math.nan})
