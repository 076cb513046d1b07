"""How long work has taken, and about how long its counted steps still will."""

from __future__ import annotations

from dataclasses import dataclass, field
from time import monotonic

MAX_SHOWN_SECONDS = 100.0  # from which minutes are shown instead, and from as many of these hours


def duration_text(seconds: float) -> str:
    """A time in s, in min from 100 s on, in h from 100 min on."""
    if seconds < MAX_SHOWN_SECONDS:
        return f"{seconds:.0f} s"
    minutes = seconds / 60.0
    return f"{minutes:.0f} min" if minutes < MAX_SHOWN_SECONDS else f"{minutes / 60.0:.1f} h"


def clock_text(seconds: float) -> str:
    """A time as a stop-watch shows it: 0:07, 12:34, 1:02:03."""
    minutes, rest = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


@dataclass(frozen=True)
class StepTimer:
    """Estimates what is left of counted steps from the time that those before took, each as long."""

    steps: int
    begin_s: float = field(default_factory=lambda: monotonic())

    def left_text(self, done: int) -> str:
        """Words behind a count of steps: ", about 12 s left"; none before the first and after the last."""
        if not 0 < done < self.steps:
            return ""
        return f", about {duration_text((monotonic() - self.begin_s) / done * (self.steps - done))} left"
