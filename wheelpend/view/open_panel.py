"""Open: logs are dropped or named, their faults come first, each with what cures it."""

from __future__ import annotations

from collections.abc import Hashable
from pathlib import Path
from typing import Any

from nicegui import events, ui

from wheelpend.reports.numbers import number_text
from wheelpend.view.panel import Panel, action, folded, paragraph, set_enabled, table, text
from wheelpend.view.uploads import LOG_SUFFIXES, keep_upload

MAX_UPLOAD_BYTES = 2 * 1024**3  # hours of a log at 1 kHz


class OpenPanel(Panel):
    """Which logs are open, which of them no fit sees, and what is wrong with them."""

    name, title = "open", "1 Open"
    purpose = "Which log is it about? Logs that are held out judge what was fitted to the others."

    def show_buttons(self) -> None:
        """A place to drop logs, a field to name one, and the inspection."""
        upload = ui.upload(
            label="Drop a log here (CSV, Parquet, MATLAB, MCAP)",
            auto_upload=True,
            max_file_size=MAX_UPLOAD_BYTES,
            on_upload=self._take,
        )
        upload.classes("drop").props(f'flat accept="{",".join(LOG_SUFFIXES)}" aria-label="Drop a log here"')
        pick = action(
            "Pick a log", lambda: None, describes="Pick a log of this machine, which is copied to the workspace"
        )
        pick.on("click", js_handler=f"() => getElement({upload.id}).pickFiles()")
        self.path = ui.input("Or its path on this machine").props("outlined dense").classes("path")
        self.path.on("keydown.enter", self._open_named)
        action("Open", self._open_named, describes="Open the log whose path is in the field")
        self.inspect = action("Inspect the log", lambda: self._inspect())
        self.new = action("Start a workspace as the log suggests", lambda: self._start())

    def update_buttons(self) -> None:
        """Inspection needs a log; a workspace is started where there is none."""
        ready = bool(self.bench.logs) and not self.bench.is_busy
        set_enabled(self.inspect, ready)
        set_enabled(self.new, ready and not (self.bench.folder / self.bench.model_name).exists())
        self.new.set_visibility(not (self.bench.folder / self.bench.model_name).exists())

    def state(self) -> Hashable:
        """The logs, and their inspection."""
        return *self.bench.logs, None, *self.bench.holdout, *self.bench.numbers("inspect")

    def show(self) -> None:
        """The logs, and what inspection found."""
        for path in self.bench.logs:
            self._show_log(path, held_out=False)
        for path in self.bench.holdout:
            self._show_log(path, held_out=True)
        found = self.bench.current("inspect")
        if found is not None:
            _show_inspection(found.result)

    def _show_log(self, path: Path, held_out: bool) -> None:
        with ui.element("div").classes("log"):
            text(f"{path.name}{', held out' if held_out else ''}")
            ui.label(str(path.parent)).classes("soft")
            action(
                "Fit to it" if held_out else "Hold it out",
                lambda: self.bench.move(path),
                describes=f"{'Fit to' if held_out else 'Hold out'} {path.name}",
            )
            action("Close", lambda: self.bench.shut(path), describes=f"Close {path.name}")

    async def _take(self, event: events.UploadEventArguments) -> None:
        try:
            self.bench.open_log(await keep_upload(event.file, self.bench.folder))
        except (OSError, ValueError) as error:
            ui.notify(str(error), type="negative")

    def _open_named(self) -> None:
        path = Path(str(self.path.value or "").strip()).expanduser()
        if path.exists() and not path.samefile(self.bench.folder):
            self.bench.open_log(path)
            self.path.set_value("")
        else:
            ui.notify(f"A log must exist; there is none at {path}.", type="negative")

    def _inspect(self) -> None:
        self.bench.run(("inspect", str(self.bench.logs[0]), *self.bench.model_words))

    def _start(self) -> None:
        self.bench.run(("new", ".", "--from", str(self.bench.logs[0])), ("equations", *self.bench.model_words))


def _show_inspection(result: dict[str, Any]) -> None:
    """What is wrong first, then the channels, then what belongs into the model file."""
    for finding in result.get("findings") or []:
        with ui.element("div").classes("note"):
            text(f"{finding.get('sentence', '')} {finding.get('cure', '')}".strip())
    if not result.get("findings"):
        paragraph("Nothing is wrong with the log.")
    channels = result.get("channels") or {}
    keys = ("minimum", "maximum", "noise", "quantum")
    rows = [[name, *(number_text(found.get(key)) for key in keys)] for name, found in channels.items()]
    table(("channel", "minimum", "maximum", "noise", "step"), rows, "What the log holds")
    for title, key in (
        ("Proposed for the model file", "proposal"),
        ("Noise and steps as the log shows them", "sensors"),
    ):
        if result.get(key):
            with folded(title):
                ui.label(result[key]).classes("code")
