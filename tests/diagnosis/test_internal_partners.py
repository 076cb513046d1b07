"""An effect that moves inside a machine is refitted wherever a score leads to it, as a partner only where it pays."""

import numpy as np

from tests.support import simulated
from wheelpend import Model
from wheelpend.diagnosis.candidates import CandidateSelection
from wheelpend.diagnosis.rounds import RoundStart, screen
from wheelpend.estimation.data import prepare
from wheelpend.estimation.starts import best_start


def test_a_share_is_asked_only_of_partners():
    log = simulated(duration=8.0, seed=3, drive_compliance__stiffness=60.0, drive_compliance__damping=0.3)
    problem, start = best_start(prepare(Model.default(), [log]))
    screened = screen(problem, RoundStart(start), lambda text: None)
    free, partner = (CandidateSelection(screened, lambda text: None, share) for share in (0.0, 0.2))
    assert "drive_compliance" in free.promising(free.select_for_refit())
    enough = 0.2 * screened.base.fit.count
    own = {n: c.gain for n, c in partner.candidates.items() if c.effect.releases}
    assert len(own) > 2 and partner.promising(list(own)) == [n for n, gain in own.items() if gain >= enough]
    lost = next(c for c in partner.candidates.values() if c.effect.releases)
    partner.candidates[lost.effect.name] = lost._replace(gain=-np.inf)
    assert lost.effect.name not in partner.promising([lost.effect.name])
    assert free.promising([lost.effect.name]) == [lost.effect.name]
