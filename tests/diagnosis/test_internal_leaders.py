"""An effect that moves inside a machine is refitted only where a score says that it may be the leading one."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support import simulated
from wheelpend import Model, diagnose
from wheelpend.diagnosis.candidates import CandidateSelection
from wheelpend.diagnosis.rounds import RoundStart, screen
from wheelpend.diagnosis.score_test import ScoreTest
from wheelpend.estimation.data import prepare
from wheelpend.estimation.starts import best_start


@pytest.fixture(scope="module")
def screened():
    """A model without the compliance that its machine has."""
    log = simulated(duration=8.0, seed=3, drive_compliance__stiffness=60.0, drive_compliance__damping=0.3)
    problem, start = best_start(prepare(Model.default(), [log]))
    return screen(problem, RoundStart(start), lambda text: None)


def with_gains(screened, full: float, short: float) -> CandidateSelection:
    """The selection where the compliance takes away these shares of what is above the noise."""

    def changed(found: ScoreTest, fitted, share: float) -> ScoreTest:
        gain = share * (1.0 - (screened.problem.floor / fitted.error) ** 2) * fitted.count
        return found._replace(
            candidates=tuple(
                c._replace(gain=gain) if c.effect.name == "drive_compliance" else c for c in found.candidates
            )
        )

    values, first = screened.short_score_tests[0]
    return CandidateSelection(
        replace(
            screened,
            full_score_test=changed(screened.full_score_test, screened.base.fit, full),
            short_score_tests=[(values, changed(first, screened.short_base, short)), *screened.short_score_tests[1:]],
        ),
        lambda text: None,
    )


def test_the_compliance_that_a_machine_has_is_tried(screened):
    selection = CandidateSelection(screened, lambda text: None)
    assert "drive_compliance" in selection.select_for_refit() and selection.may_lead("drive_compliance")


def test_a_quarter_of_what_is_above_the_noise_is_asked_of_either_score_test(screened):
    shares = [(0.24, 0.24), (0.26, 0.1), (0.1, 0.26), (0.26, 0.26)]
    assert [with_gains(screened, *pair).may_lead("drive_compliance") for pair in shares] == [False, True, True, True]


def test_what_no_score_can_be_simulated_of_is_tried(screened):
    assert with_gains(screened, -np.inf, 0.0).may_lead("drive_compliance")
    assert with_gains(screened, 0.0, -np.inf).may_lead("drive_compliance")


@pytest.mark.slow
def test_sloshing_that_shows_on_full_segments_only_is_found_where_others_leave_noise_on_shorter_ones():
    log = simulated(
        command="simple", seed=19,
        slosh__mass_ratio=0.139414, slosh__height=0.5, slosh__frequency=8.0, slosh__damping=0.3,
    )  # fmt: skip
    found = diagnose(Model.default(), [log])
    assert [c.effect for c in found.named] == ["slosh"]
    size = found.named[0].estimates["mass_ratio"]
    assert abs(size.value - 0.14) < 3.0 * size.sigma < 0.1
