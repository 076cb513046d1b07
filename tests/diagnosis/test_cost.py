"""A diagnosis stays cheap: told by simulated samples and by ratios of processor time."""

import numpy as np
import pytest

from tests.support import quickest, simulated
from wheelpend import Model, diagnose
from wheelpend.diagnosis import pair_search
from wheelpend.estimation.filter_error import FilterProblem


@pytest.mark.slow
def test_a_diagnosis_simulates_and_filters_the_log_a_few_hundred_times(samples, monkeypatch):
    log, filtered, run_log = simulated(duration=20.0, coulomb_drive__torque=0.3), [], FilterProblem._run_log

    def counted(problem, number, *rest):
        filtered.append(np.diff(problem.segments[number].bounds).sum())
        return run_log(problem, number, *rest)

    monkeypatch.setattr(FilterProblem, "_run_log", counted)
    diagnose(Model.default(), [log])
    assert 100 * len(log) < sum(samples.values()) < 450 * len(log)
    assert 100 * len(log) < sum(filtered) < 300 * len(log)


def test_a_search_among_pairs_takes_less_time_than_a_few_refits_from_the_rows():
    rng = np.random.default_rng(0)
    rows, groups = rng.normal(size=(10, 2000, 34)), [[7 + k] for k in range(26)]
    grams = np.einsum("fri,frj->fij", rows, rows, optimize=True)

    def refit():
        for held in range(10):
            others = np.delete(rows, held, axis=0).reshape(-1, 34)
            np.linalg.lstsq(others[:, :9], others[:, -1], rcond=None)

    assert quickest(lambda: pair_search.search_pairs(grams, 7, groups)) < 2.0 * quickest(refit)  # of 351 models
