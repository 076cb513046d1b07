"""Go on: keep the values, write the report, export the model, design the next log, or do the same in a terminal."""

from __future__ import annotations

from collections.abc import Hashable
from pathlib import Path

from nicegui import ui

from wheelpend.view.design_form import DesignForm, show_design
from wheelpend.view.hints import chain
from wheelpend.view.own_effect import OwnEffectForm
from wheelpend.view.panel import Panel, action, folded, paragraph, set_enabled
from wheelpend.view.words import sentences

SHOWN_COMMANDS = ("identify", "report", "design", "export")
REPORT_FILE = "report.html"
EXPORT_TARGETS = {"c": "C library", "js": "JavaScript", "fmu": "FMU", "mujoco": "MuJoCo", "json": "numbers"}


class GoOnPanel(Panel):
    """What is done with the model, and how a terminal does the same."""

    name, title = "go_on", "6 Go on"
    purpose = "Keep what was found, tell others, use the model elsewhere, or ask the machine for a log that tells more."

    def show_buttons(self) -> None:
        """Values, report, exports, the next log, an effect of one's own."""
        files = self.bench
        self.all = [
            action(
                "Keep the fitted values", lambda: files.run(*chain(files, ("identify", *files.fitted_files, "--save")))
            ),
            action("Write the report", lambda: files.run(("report", *files.files, "-o", REPORT_FILE))),
        ]
        self.target = ui.select(EXPORT_TARGETS, value="c", label="Export as").props("outlined dense").classes("choice")
        export = action("Export", lambda: files.run(("export", str(self.target.value), *files.files)))
        self.all.append(export)
        self.download = action("Save the report", self._download, describes="Save the report from the browser")
        with ui.element("div").classes("whole"):
            with folded("Design the next log: limits, and what it is to tell apart"):
                self.design = DesignForm(files)
            with folded("Write an effect of your own"):
                self.own_effect = OwnEffectForm(files)

    def update_buttons(self) -> None:
        """All of it needs a log and a model; the page of the report has to be there."""
        for button in self.all:
            set_enabled(button, self.bench.can_judge)
        self.download.set_visibility("report" in self.bench.found)
        self.design.update()
        self.own_effect.update()

    def _download(self) -> None:
        path: Path = self.bench.folder / REPORT_FILE
        if path.is_file():
            ui.download.content(path.read_bytes(), REPORT_FILE)

    def state(self) -> Hashable:
        """What was done."""
        return len(self.bench.done), *self.bench.numbers(*SHOWN_COMMANDS)

    def show(self) -> None:
        """What the last of these said, and every command line so far."""
        for name in SHOWN_COMMANDS:
            if found := self.bench.current(name):
                with folded(f"What {name} said", is_open=name == "design"):
                    for sentence in sentences(found.text):
                        paragraph(sentence)
                    if name == "design":
                        show_design(self.bench, found.result)
        if self.bench.done:
            paragraph("The same on the command line:", "soft")
            ui.label("\n".join([f"cd {self.bench.quoted_folder}", *self.bench.done])).classes("code commands")
