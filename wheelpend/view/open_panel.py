"""Open: logs are dropped or named, their faults come first, each with what cures it."""

from __future__ import annotations

from collections.abc import Hashable
from pathlib import Path
from typing import Any

from nicegui import events, ui

from derive.plants import KNOWN_PLANTS
from wheelpend.logs.columns import ColumnMap
from wheelpend.reports.numbers import number_text
from wheelpend.view.column_form import ColumnForm
from wheelpend.view.corrections import changed_settings, cures_of, proposed_settings, stated_columns
from wheelpend.view.panel import Panel, action, folded, paragraph, set_enabled, table, text
from wheelpend.view.signal_chart import signal_chart
from wheelpend.view.signals import MAP_KEYS
from wheelpend.view.uploads import keep_upload

SUGGESTED_PLANT = "as the log suggests"
MAX_UPLOAD_BYTES = 2 * 1024**3  # hours of a log at 1 kHz


class OpenPanel(Panel):
    """Which logs are open, which of them no fit sees, and what is wrong with them."""

    name, title = "open", "1 Open"
    purpose = "Which log is it about? Logs that are held out judge what was fitted to the others."

    def show_buttons(self) -> None:
        """A place to drop logs, a field to name one, and the inspection."""
        upload = ui.upload(
            label="Drop a log here (CSV or Parquet)",
            auto_upload=True,
            max_file_size=MAX_UPLOAD_BYTES,
            on_upload=self._take,
        )
        upload.classes("drop").props('flat accept=".csv,.parquet" aria-label="Drop a log here"')
        pick = action(
            "Pick a log", lambda: None, describes="Pick a log of this machine, which is copied to the workspace"
        )
        pick.on("click", js_handler=f"() => getElement({upload.id}).pickFiles()")
        self.path = ui.input("Or its path on this machine").props("outlined dense").classes("path")
        self.path.on("keydown.enter", self._open_named)
        action("Open", self._open_named, describes="Open the log whose path is in the field")
        self.inspect = action("Inspect the log", lambda: self._inspect())
        self.plant = ui.select([SUGGESTED_PLANT, *KNOWN_PLANTS], value=SUGGESTED_PLANT, label="Plant")
        self.plant.props("outlined dense use-input new-value-mode=add-unique").classes("choice")
        self.plant.props["hint"] = "or FILE.py"
        self.new = action("Start a workspace as the log suggests", lambda: self._start())
        self.cures: list[ui.button] = []  # that change how the log is read
        self.offered: list[list[str]] = []  # the settings of those that cure a fault

    def update_buttons(self) -> None:
        """Inspection needs a log; a workspace is started where there is none."""
        ready = bool(self.bench.logs) and not self.bench.is_busy
        set_enabled(self.inspect, ready)
        set_enabled(self.new, ready and not self._has_model)
        for shown in (self.new, self.plant):
            shown.set_visibility(not self._has_model)
        for button in self.cures:
            set_enabled(button, ready)

    def state(self) -> Hashable:
        """The logs, their inspection, and whether there is a model that says how they are read."""
        found = self.bench.numbers("inspect", "signals")
        return *self.bench.logs, None, *self.bench.holdout, *found, self._has_model

    def show(self) -> None:
        """The logs, and what inspection found."""
        self.cures.clear()
        self.offered.clear()
        for path in self.bench.logs:
            self._show_log(path, held_out=False)
        for path in self.bench.holdout:
            self._show_log(path, held_out=True)
        found = self.bench.current("inspect")
        if found is not None:
            self._show_faults(found.result)
            self._show_signals()
            _show_rest(found.result)
            self._offer_noise(found.result)

    def _show_faults(self, result: dict[str, Any]) -> None:
        """What is wrong first, each fault with the button that cures it."""
        proposed = proposed_settings(result.get("proposal") or "") if self._has_model else {}
        for finding in result.get("findings") or []:
            with ui.element("div").classes("note"):
                text(f"{finding.get('sentence', '')} {finding.get('cure', '')}".strip())
                self._offer_cure(str(finding.get("channel", "")), cures_of(finding, proposed))
        if not result.get("findings"):
            paragraph("Nothing is wrong with the log.")
        if len(proposed) > 1:
            self.cures.append(action("Read it as proposed", lambda: self._set(list(proposed.values()))))

    def _offer_cure(self, channel: str, settings: list[str]) -> None:
        """A button that makes settings, if there are any that no other button makes."""
        if settings and settings not in self.offered:
            self.offered.append(settings)
            cure = action(f"Cure {channel}", lambda: self._set(settings), describes=f"Write the cure of {channel}")
            self.cures.append(cure)

    def _show_signals(self) -> None:
        """The signals as they are read, beside how each is read."""
        found = self.bench.current("signals")
        if found is None or not found.series:
            return
        (log,), (series,) = found.result["logs"], found.series
        with folded(f"The signals of {log['name']}, as they are read", is_open=True):
            signal_chart(series, log["names"], found.result["units"])
        if not self._has_model:
            return
        maps = stated_columns(found.result["maps"], MAP_KEYS)
        guessed = [name for name, told in found.result["maps"].items() if told["guessed"]]
        with folded("How each is read, to be corrected"):
            form = ColumnForm(maps, guessed, found.result["columns"], self._read_so)
        self.cures.append(form.button)

    def _offer_noise(self, result: dict[str, Any]) -> None:
        """The noises and steps that the log shows, for the model file."""
        if result.get("sensors") and self._has_model:
            settings = list(proposed_settings(result["sensors"]).values())
            self.cures.append(action("State noise and steps so", lambda: self._set(settings)))

    def _read_so(self, chosen: dict[str, ColumnMap]) -> None:
        model = self.bench.model()
        settings = changed_settings(chosen, model.columns if model else {})
        if settings:
            self._set(settings)
        else:
            ui.notify("The log is read so already.")

    def _set(self, settings: list[str]) -> None:
        self.bench.run(("set", *settings, *self.bench.model_words), *self._inspection())

    def _inspection(self) -> list[tuple[str, ...]]:
        """The commands that look at the first log."""
        words = (str(self.bench.logs[0]), *self.bench.model_words)
        return [("inspect", *words), ("signals", *words)]

    @property
    def _has_model(self) -> bool:
        return (self.bench.folder / self.bench.model_name).exists()

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
        self.bench.run(*self._inspection())

    def _start(self) -> None:
        plant = str(self.plant.value or SUGGESTED_PLANT)
        chosen = () if plant == SUGGESTED_PLANT else ("--plant", plant)
        begin = ("new", ".", *chosen, "--from", str(self.bench.logs[0]))
        self.bench.run(begin, ("equations", *self.bench.model_words), *self._inspection())


def _show_rest(result: dict[str, Any]) -> None:
    """The channels, then what belongs into the model file."""
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
