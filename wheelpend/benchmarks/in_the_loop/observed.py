"""Observer, compensator and identifier of an export, run by the kernels that every language is translated from."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from wheelpend.export.compensation import compensation_of
from wheelpend.export.exported_model import ExportedModel


class Observed:
    """A machine's state from its sensors, sample by sample; on request its parameters are learnt as it runs."""

    def __init__(self, exported: ExportedModel, values: np.ndarray | None = None, forgetting: float = 1.0) -> None:
        """Begin at rest; with ``values`` (n,) what the export's identifier learns begins there, and is learnt."""
        self.forgetting = forgetting
        nothing, m = np.zeros(0), cast(Any, exported.module)  # whose kernels for real time no protocol has
        e, columns = exported, nothing.astype(np.int64) if values is None else exported.learnt
        count, n = len(e.sources), len(columns)
        self.exported, self.module, self.columns = e, m, columns
        self.parameters, self.time = e.parameters.copy(), 0.0
        if values is not None:
            self.parameters[columns] = values
        self.learnt, self.least = np.diag(e.doubt if n else nothing), e.least if n else nothing
        self.noise = (e.noise_at_start if n else e.noise).copy()
        self.now, self.commands, self.innovation = np.zeros(e.size), np.zeros(e.commands), np.zeros(m.NY)
        self.moving = [np.zeros((e.size, e.size + m.NQ + n)), np.zeros(count), np.zeros((count, n)),
                       np.zeros((e.size + count, e.size + count))]  # fmt: skip
        self.rubbing, self.no_gate, self.taken = np.zeros(m.SURFACES), np.zeros(m.NY), np.zeros(m.NY)
        m.start_filter(np.zeros(m.NX), e.spread, 0.0, self.parameters, e.reads, self.noise, self.now, self.commands,
                       *self.moving, self.rubbing)  # fmt: skip

    def see(self, measured: np.ndarray) -> None:
        """Take a sample's readings (NY,)."""
        e = self.exported
        self.module.filter_readings(
            self.time, measured, 1.0 / e.readings_sigma, self.parameters, self.columns, e.reads, self.now, *self.moving,
            self.learnt, self.least, self.innovation, self.no_gate, self.taken,
        )  # fmt: skip
        if len(self.columns):
            _, force, force_by, covariance = self.moving
            self.module.adapt_filter(
                self.time, e.period, self.forgetting, e.doubt, self.learnt, force, force_by, covariance, self.noise
            )

    def go_on(self, voltage: float) -> None:
        """Move on to the next sample under a voltage [V]."""
        e = self.exported
        self.module.filter_step(
            self.time, e.period, voltage, self.parameters, self.columns, e.forces, e.mixing, e.reads, self.noise,
            e.max_step, self.now, self.commands, *self.moving, self.rubbing,
        )  # fmt: skip
        self.time += e.period


class Compensated:
    """The export's observer with its compensator: from readings and the voltage that is wanted to the one to apply."""

    def __init__(self, exported: ExportedModel) -> None:
        self.observed = Observed(exported)
        compensation = compensation_of(exported)
        assert compensation is not None, "the model has friction"
        self.by = compensation

    def voltage(self, measured: np.ndarray, wanted: float) -> float:
        """The voltage [V] under which the machine moves as one without friction would under the one that is wanted."""
        self.observed.see(measured)
        c = self.by
        applied = float(self.observed.module.compensate(0.0, wanted, self.observed.now, c.forces, c.absent, c.maps,
                                                        c.shares, c.least_slip, c.least_input))  # fmt: skip
        self.observed.go_on(applied)
        return applied
