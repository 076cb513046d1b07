"""One line under the title: what runs, for how long, and how to end it; else what to do next."""

from __future__ import annotations

from nicegui import ui

from wheelpend.durations import clock_text
from wheelpend.view.bench import Bench
from wheelpend.view.hints import hint_text, next_step
from wheelpend.view.panel import action


class StatusLine:
    """What is being done, what became of it, what comes next."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        with ui.element("div").classes("status"):
            self._show()
        self.update()

    def _show(self) -> None:
        with ui.element("div").props('role="status" aria-live="polite"'):
            self.hint = ui.label().classes("plain hint")
            self.link = ui.link("Go there", "#open").classes("there")
            self.failure = ui.label().classes("plain failure").props('role="alert"')
        with ui.element("div").classes("running"):
            self.bar = ui.linear_progress(show_value=False).props('indeterminate aria-label="A command runs"')
            self.progress = ui.label().classes("plain soft").props('aria-live="off"')
            self.cancel = action("Cancel", self.bench.cancel, describes="Cancel the command that runs")

    def update(self) -> None:
        """Show what changed since the last time."""
        job = self.bench.job
        for part in (self.bar, self.progress, self.cancel):
            part.set_visibility(job is not None)
        if job is not None:
            self.progress.set_text(f"{clock_text(job.elapsed_s)} {job.words[0]} {job.progress()}")
        self.hint.set_text(self._hint(job is not None))
        self.link.props(f'href="#{next_step(self.bench).panel}"')
        self.link.set_visibility(job is None)
        self.failure.set_text(self.bench.failure)
        self.failure.set_visibility(bool(self.bench.failure))

    def _hint(self, runs: bool) -> str:
        if runs:
            more = len(self.bench.waiting)
            return f"Running{f', and {more} more after it' if more else ''}."
        said = f"{self.bench.said} " if self.bench.said.startswith("Cancelled") else ""
        return f"{said}{hint_text(self.bench)}"
