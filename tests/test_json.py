"""The keys of JSON are those that are documented, whatever the fields of the records are called."""

import ast
import json
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest

import wheelpend
from wheelpend import Model, load_log, serialise
from wheelpend.benchmarks.hidden_effects.trial import Outcome
from wheelpend.campaigns import one_log, summary
from wheelpend.campaigns.runner import Campaign
from wheelpend.cli.design import WrittenDesign
from wheelpend.diagnosis.change import Change
from wheelpend.diagnosis.compare import Comparison
from wheelpend.diagnosis.evidence import CandidateFit, LogEstimate
from wheelpend.diagnosis.explain import Ladder, Step
from wheelpend.diagnosis.horizons import HorizonError
from wheelpend.diagnosis.likelihood.remaining import ImpossibleLaw
from wheelpend.diagnosis.likelihood.slow_sources import SlowSource
from wheelpend.diagnosis.missing_force.estimate import ForceConcentration
from wheelpend.diagnosis.missing_force.law_search import FreeLaw
from wheelpend.diagnosis.missing_force.repeatability import ExplainedForce
from wheelpend.diagnosis.model_errors import ModelErrors
from wheelpend.diagnosis.replay import ClosedLoopReplay
from wheelpend.diagnosis.verdict import Diagnosis
from wheelpend.estimation.estimate import Covariance, Estimate, LogValue
from wheelpend.experiments.design import Design, ExpectedErrors, Peaks
from wheelpend.experiments.simulated_experiment import Limits
from wheelpend.export.ledger import Carried, Ledger
from wheelpend.identification.bias_test import BiasTest
from wheelpend.identification.identify import Identification
from wheelpend.identification.recursive import TrackPoint
from wheelpend.identification.remainder import Remainder, RowForce, SensorError
from wheelpend.identification.residual_tests import ChannelResidual, ResidualTests
from wheelpend.identification.time_constants import TimeConstantChoice, TimeConstantPair
from wheelpend.identification.widening import Widening
from wheelpend.inspection.findings import Finding
from wheelpend.inspection.inspect import inspect_log
from wheelpend.logs.shipped import DEMO_LOG, data_folder
from wheelpend.model.workspace import HistoryEntry
from wheelpend.paper.findings import EquationFinding, Verification
from wheelpend.paper.printed_numbers import NumberCheck
from wheelpend.proportion import Proportion
from wheelpend.reproduction import choices, tables
from wheelpend.reproduction.record import Reproduction

KEYS = {
    Identification: "method parameters condition_number samples error noise_floor warnings tau hold forgetting track "
    "bias guide force_error cutoff_hz remainder covariance widening fixed at_bounds",
    Covariance: "names matrix",
    Widening: "factors correlation_times_s",
    Remainder: "force sensors places repeatable_share repeating resonances slow impossible instead unpredicted",
    SlowSource: "place is_force correlation_time_s gain p_value",
    ImpossibleLaw: "effect coefficients p_value",
    RowForce: "rms unit rms_torque share_of_drive share correlation_time_s place at_bound",
    SensorError: "rms unit sigmas share_of_signal correlation_time_s lag_s smaller_sigmas smaller_time_s",
    Estimate: "value sigma identifiable",
    LogValue: "log value sigma",
    TrackPoint: "t parameters",
    BiasTest: "p_value biased against difference_percent sigma_percent predicted_bias_percent "
    "predicted_spread_percent replicas",
    TimeConstantChoice: "rows chosen reason against replicas",
    TimeConstantPair: "tau1 tau2 bias_percent spread_percent score",
    ResidualTests: "channels remainder fitted_first warnings",
    ChannelResidual: "white whiteness_p independent_of_input_p sigma_ratio sigma_assumed quantised kurtosis lags_s "
    "autocorrelation band quantiles samples",
    Comparison: "error noise_floor horizon_s fit_percent rmse horizons closed_loop where fitted_first warnings "
    "force_error bursts per_log remainder residuals against",
    ModelErrors: "model error fit_percent rmse horizons fitted_first",
    HorizonError: "seconds error diverged",
    ClosedLoopReplay: "rmse rmse_input diverged",
    ForceConcentration: "row state from to share",
    Diagnosis: "verdict horizon_s error noise_floor fit_percent candidates experiment detectable where not_judged "
    "warnings missing law remainder structures steps error_with_steps",
    CandidateFit: "effect family coefficients sigma unit p_value probability blocks_agree error_after "
    "equivalent_to physical "
    "beyond per_log p_discovery p_confirmation held_out_gain in_sample_gain",
    LogEstimate: "log coefficients sigma",
    ExplainedForce: "row depends_on alone repeatable",
    FreeLaw: "laws on coefficients sigma unit error_before error_after noise_floor blocks_agree explains tried",
    Ladder: "verdict nominal_error base_error steps effects error noise_floor horizon_s parameters experiment "
    "warnings missing law remainder structures",
    Step: "effect coefficients sigma unit p_value equivalent_to error_before error_after parameters per_log "
    "blocks_agree held_out_gain force_before force_after probability",
    HistoryEntry: "change error_before error_after logs parameters",
    Finding: "kind channel sentence cure size settings effect",
    Design: "between command duration_s sample_s limits separation gap parameters builtin peaks gains own_controller "
    "sentences",
    Limits: "pitch voltage",
    ExpectedErrors: "value logs builtin designed",
    Peaks: "pitch voltage wheel_travel factor",
    Campaign: "do method simulated logs summary fleet then",
    one_log.SimulationSpec: "command duration hide",
    one_log.LogResult: "log seed failure verdict named effects error error_after noise_floor fit_percent parameters "
    "covariance warnings unit date conditions",
    one_log.NamedEffect: "effect equivalent_to",
    one_log.Estimate: "value sigma",
    summary.Summary: "logs failed error error_after effects parameters disagreeing unexplained verdicts named hidden "
    "found first_right false_alarms",
    summary.Range: "mean smallest largest",
    summary.ParameterRecovery: "logs truth mean bias bias_sigma spread sigma inside",
    summary.ParameterAgreement: "logs mean mean_sigma spread sigma chi_square degrees p_value furthest",
    summary.LargestDeviation: "log sigmas",
    Proportion: "hits of",
    Carried: "carried note",
    Verification: "equations parameters",
    EquationFinding: "number name status printed derived note how assumption shows agrees_with",
    NumberCheck: "name status printed derived note how",
    Reproduction: "what seeds duration_s table1 table2 started_at_rest conditions table3 predictions choices "
    "unstable_pole written",
    tables.Cell: "parameter command method median p10 p90 bias failed paper percentile",
    tables.Condition: "command method plain scaled",
    tables.Deviation: "case tau deviation_deg hold parameter estimate error paper_estimate paper_error ratio lowest "
    "highest",
    tables.Prediction: "channel command paper from_printed median p10 p90 fallen",
    choices.Choice: "name open made effects",
    choices.ChoiceEffect: "table of alternative smallest largest",
    Outcome: "key kind source size hidden soft failure verdict named equivalents final base_error error true_error "
    "floor costs strength deviations estimates made seconds",
}
STEP_KEYS = KEYS[Step].replace("p_value equivalent_to ", "").replace("parameters ", "").split(" held_out_gain")[0]


def blank(record, **given):
    """A record whose fields are None but for those that are given."""
    if not is_dataclass(record):
        return record(*[None] * len(record._fields))
    made = object.__new__(record)
    for field in fields(record):
        object.__setattr__(made, field.name, given.get(field.name))
    return made


@pytest.mark.parametrize("record", KEYS, ids=lambda record: record.__name__)
def test_a_record_is_written_under_the_documented_keys(record):
    assert list(blank(record, estimates={}).to_json()) == KEYS[record].split()


def test_a_parameter_that_each_log_has_for_itself_is_written_for_each():
    several = Estimate(0.01, 0.001, "rad", per_log=(LogValue("a.csv", 0.01, 0.001),))
    assert serialise.plain_data(several)["per_log"] == [{"log": "a.csv", "value": 0.01, "sigma": 0.001}]


def test_an_inspection_is_written_under_the_documented_keys():
    data = serialise.to_json(inspect_log(load_log(data_folder() / DEMO_LOG).part(0, 2000)))
    named = "schema samples duration_s rate_hz jitter gaps channels findings proposal sensors stand_still"
    assert list(data) == named.split()
    assert list(data["gaps"]) == ["count", "longest"]
    assert list(data["channels"]["theta_w"]) == ["minimum", "maximum", "noise", "quantum", "missing"]


def test_a_change_is_its_step_with_the_model_after_it():
    after = SimpleNamespace(floor=1.0, horizon=0.5)
    data = serialise.to_json(Change(blank(Step, estimates={}), Model.default(), after, None, None))
    assert list(data) == ["schema", *STEP_KEYS.split(), "effects", "noise_floor", "horizon_s", "parameters",
                          "remainder", "warnings"]  # fmt: skip
    assert list(data["parameters"]["X1"]) == ["value", "sigma"]


def test_a_designed_command_is_written_with_its_file_and_logs():
    data = serialise.to_json(WrittenDesign(blank(Design), Path("next.csv"), ("a.csv",)))
    assert list(data) == ["schema", *KEYS[Design].split(), "file", "logs"]


def test_an_export_is_written_as_its_ledger_is():
    data = serialise.to_json(Ledger("c", "wheel_pendulum", {"cogging": Carried("not")}))
    named = "schema target plant effects error error_in_target replayed notes files"
    assert list(data) == named.split() and data["effects"] == {"cogging": {"carried": "not", "note": ""}}


def test_keys_are_those_of_to_json_and_not_the_names_of_fields():
    class Renamed(NamedTuple):
        lower_end: float

        def to_json(self):
            return {"from": self.lower_end}

    assert serialise.to_json(Renamed(0.5)) == {"schema": 1, "from": 0.5}


def test_a_record_that_does_not_say_what_is_written_is_refused():
    @dataclass
    class Mute:
        value: float

    class MuteTuple(NamedTuple):
        value: float

    for record in (Mute(1.0), MuteTuple(1.0)):
        with pytest.raises(TypeError, match=f"to_json.*{type(record).__name__}"):
            serialise.plain_data({"inside": [record]})


def test_no_room_makes_json_of_the_names_of_fields():
    package = Path(wheelpend.__file__).parent
    names = {
        f"{path.relative_to(package)}: {alias.name}"
        for path in package.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom) and node.module == "dataclasses"
        for alias in node.names
        if alias.name in ("asdict", "astuple", "fields")
    }
    assert names == {"model/toml_checks.py: fields"}  # what a model.toml may hold


def test_numbers_are_plain_and_what_is_none_is_null():
    values = {"a": np.float64(1.5), "b": np.array([1, 2]), "c": np.bool_(True), "d": float("inf"), "e": (None, "x")}
    text = serialise.dumps(serialise.plain_data(values | {"f": float("nan")}))
    assert json.loads(text) == {"a": 1.5, "b": [1, 2], "c": True, "d": None, "e": [None, "x"], "f": None}
