"""Which stretch of a log is held out: two sliders under its chart, and the button that splits it there."""

from __future__ import annotations

from pathlib import Path

from nicegui import ui

from wheelpend.view.bench import Bench
from wheelpend.view.panel import action
from wheelpend.view.time_chart import TimeChart

DEFAULT_STRETCH = (2.0 / 3.0, 1.0)  # of a log, that is offered: as a command without --holdout judges on the last third
HANDLE_STEPS = 200  # of the handles, along a log


class StretchControl:
    """The handles over a log's time [s], and what they do."""

    def __init__(self, bench: Bench, log: Path, duration_s: float, chart: TimeChart) -> None:
        self.bench, self.log, self.chart = bench, log, chart
        self.split = bench.splits.get(log)
        step = _round_step(duration_s / HANDLE_STEPS)
        begin, end = (
            (self.split.begin_s, self.split.end_s)
            if self.split
            else (_on_steps(share * duration_s, step) for share in DEFAULT_STRETCH)
        )
        with ui.element("div").classes("stretch"):
            most = _on_steps(duration_s, step) + step
            self.begin, self.end = (
                self._handle(f"{end} of the stretch of {log.name} that is held out, in s", value, most, step)
                for end, value in (("Begin", begin), ("End", end))
            )
            self.button = action(self._words(), self._hold_out, describes=f"{self._words()} of {log.name}")
            if self.split:
                action("Whole log again", lambda: bench.join(log), describes=f"Fit to the whole of {log.name} again")

    def _handle(self, describes: str, value: float, most: float, step: float) -> ui.slider:
        """A slider for one end; one for each, since screen readers know no slider with two handles."""
        handle = ui.slider(min=0, max=most, step=step, value=value).props("label snap")
        handle.props["aria-label"] = describes
        handle.on("change", self._moved)
        return handle

    @property
    def stretch(self) -> tuple[float, float]:
        """Where it begins and ends [s], whichever handle is which."""
        begin, end = sorted((float(self.begin.value), float(self.end.value)))
        return begin, end

    def _words(self) -> str:
        begin, end = self.stretch
        return f"Hold out {begin:g} to {end:g} s"

    def _moved(self) -> None:
        self.button.set_text(self._words())
        self.button.props["aria-label"] = f"{self._words()} of {self.log.name}"
        self.chart.shade(*self.stretch)

    def _hold_out(self) -> None:
        self.bench.hold_out_stretch(self.log, *self.stretch)


def _round_step(seconds: float) -> float:
    """The next of 1, 2 and 5 times a power of ten that is no shorter."""
    power = 10.0 ** int(f"{seconds:e}".partition("e")[2])
    return round(next(k * power for k in (1, 2, 5, 10) if k * power >= seconds * (1 - 1e-9)), 12)


def _on_steps(seconds: float, step: float) -> float:
    return round(round(seconds / step) * step, 9)
