"""Open: logs are dropped or named, their faults come first, each with what cures it."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from nicegui import events, ui

from derive import plants
from wheelpend.reports.numbers import number_text
from wheelpend.view.corrections import changed, cures, setting_words, settings_of
from wheelpend.view.hints import chain
from wheelpend.view.panel import Panel, action, folded, paragraph, set_enabled, table, text
from wheelpend.view.reading_form import ReadingForm
from wheelpend.view.readings_chart import readings_chart
from wheelpend.view.uploads import LOG_SUFFIXES, keep_upload

GUESSED_PLANT = "as the log suggests"
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
        self.inspect = action("Inspect the log", lambda: self._inspect(self.bench.logs[0]))
        with ui.element("div").classes("buttons") as self.beginning:
            self.plant = ui.select({"": GUESSED_PLANT}, value="", label="Plant").props("outlined dense")
            self.plant.classes("choice")
            self.plant_file = ui.input("Or the FILE.py of a plant of yours").props("outlined dense").classes("path")
            self.new = action("Start a workspace as the log suggests", lambda: self._start())
        self.sets: list[ui.button] = []  # that change the model file

    def update_buttons(self) -> None:
        """Inspection needs a log; a workspace is started where there is none."""
        ready = bool(self.bench.logs) and not self.bench.is_busy
        for button in (self.inspect, self.new, *self.sets):
            set_enabled(button, ready)
        self.beginning.set_visibility(not self.has_model)
        if not self.has_model:
            self._update_plants()

    def _update_plants(self) -> None:
        """Offer the library's plants, beside the one that the log suggests, which is chosen unless another was."""
        found = self.bench.current("inspect")
        guess = settings_of((found.result.get("model") if found else "") or "").get("plant", "")
        options = {"": f"{guess}, as the log suggests" if guess else GUESSED_PLANT} | {
            n: n for n in plants.KNOWN_PLANTS
        }
        if self.plant.options != options:
            self.plant.set_options(options)

    @property
    def has_model(self) -> bool:
        """True where the folder is a workspace."""
        return (self.bench.folder / self.bench.model_name).exists()

    def state(self) -> Hashable:
        """The logs, what was found in one, and whether it can be corrected."""
        return (
            *self.bench.logs,
            None,
            *self.bench.holdout,
            *self.bench.numbers("inspect", "readings"),
            self.has_model,
        )

    def show(self) -> None:
        """The logs, and what inspection found."""
        self.sets.clear()
        for path in self.bench.logs:
            self._show_log(path, held_out=False)
        for path in self.bench.holdout:
            self._show_log(path, held_out=True)
        readings, found = self.bench.current("readings"), self.bench.current("inspect")
        if readings is None or not readings.series:
            return
        name, (log,) = readings.words[1], readings.result["logs"]
        is_inspected = found is not None and found.words[1] == name and found.number > readings.number
        if found is not None and is_inspected:
            self._show_faults(found.result, log, name)
        self._show_readings(log, readings.series[0], name)
        if found is not None and is_inspected:
            _show_rest(found.result)

    def _show_faults(self, result: dict[str, Any], log: dict[str, Any], path: str) -> None:
        """What is wrong, each with the button that cures it; noise is stated once the units are right."""
        findings, proposal = result.get("findings") or [], result.get("proposal") or ""
        for finding in findings:
            with ui.element("div").classes("note"):
                text(f"{finding.get('sentence', '')} {finding.get('cure', '')}".strip())
                if finding.get("settings") and self.has_model:
                    self._offer(f"Set {' '.join(setting_words(finding['settings']))}", finding["settings"], path)
                if (effect := finding.get("effect")) and self.has_model:
                    self._offer_effect(effect)
        if not findings:
            paragraph("Nothing is wrong with the log.")
        if not self.has_model:
            return
        together = cures(findings, proposal)
        if together and setting_words(together) not in [setting_words(f.get("settings") or {}) for f in findings]:
            self._offer("Set all that is proposed", together, path)
        stated = {sensor["key"]: sensor["value"] for sensor in log.get("sensors", ())}
        if not together and (sensors := changed(settings_of(result.get("sensors") or ""), stated)):
            self._offer("State noise and steps as this log shows them", sensors, path)

    def _offer(self, words: str, settings: Mapping[str, Any], path: str) -> None:
        """A button that makes settings."""
        describes = f"Set {' '.join(setting_words(settings))}"
        self.sets.append(action(words, lambda: self._set(settings, path), describes=describes))

    def _offer_effect(self, effect: str) -> None:
        """A button that adds what a fault is of where it is physics and no fault."""
        model = self.bench.model()
        if model is not None and effect not in model.effects:
            commands = chain(self.bench, ("add", effect, *self.bench.files))
            self.sets.append(action(f"The delay is real: add {effect}", lambda: self.bench.run(*commands)))

    def _show_readings(self, log: dict[str, Any], series: np.ndarray, path: str) -> None:
        """The signals beside how each is read, which is open where the model cannot read the log."""
        if log["refusal"]:
            with ui.element("div").classes("note"):
                text(log["refusal"])
        if log["left_out"]:
            paragraph(f"Not drawn: {', '.join(log['left_out'])}.", "soft")
        units = {q["name"]: q["own_unit"] for q in log.get("quantities", ())} if not log["refusal"] else {}
        with ui.element("div").classes("readings" if "quantities" in log else ""):
            with ui.element("div"), folded(f"Signals of {log['name']}", is_open=True):
                readings_chart(series, [f"{n} [{units[n]}]" if n in units else n for n in log["channels"]])
            if "quantities" in log:
                with ui.element("div"), folded("How it is read", is_open=True):
                    form = ReadingForm(log)
                    apply = action(
                        "Read it so",
                        lambda: self._set(form.settings(), path),
                        describes="Write what was changed in these fields to the model file, and look again",
                    )
                    self.sets.append(apply)

    def _set(self, settings: Mapping[str, Any], path: str) -> None:
        if settings:
            again = [("equations", *self.bench.model_words)] * ("equations" in self.bench.found)
            words = ("set", *setting_words(settings), *self.bench.model_words)
            self.bench.run(words, *again, *self._looks(path))
        else:
            ui.notify("The model file states this already: the log is read so.")

    def _looks(self, path: str) -> list[tuple[str, ...]]:
        """The commands that look at a log; its signals first, which are drawn also where it cannot be inspected."""
        return [(name, path, *self.bench.model_words) for name in ("readings", "inspect")]

    def _show_log(self, path: Path, held_out: bool) -> None:
        with ui.element("div").classes("log"):
            text(f"{path.name}{', held out' if held_out else ''}")
            ui.label(str(path.parent)).classes("soft")
            action(
                "Fit to it" if held_out else "Hold it out",
                lambda: self.bench.move(path),
                describes=f"{'Fit to' if held_out else 'Hold out'} {path.name}",
            )
            look = action("Inspect", lambda: self._inspect(path), describes=f"Inspect {path.name}")
            self.sets.append(look)
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

    def _inspect(self, path: Path) -> None:
        self.bench.run(*self._looks(str(path)))

    def _start(self) -> None:
        """Start a workspace of the plant that was chosen, and look at the log as its model reads it."""
        file = str(self.plant_file.value or "").strip()
        if file:
            self.bench.plant_file = Path(file).expanduser().absolute()
        plant = self.bench.plant_words or (("--plant", str(self.plant.value)) if self.plant.value else ())
        path = str(self.bench.logs[0])
        begin = ("new", ".", *plant, "--from", path)
        self.bench.run(begin, ("equations", *self.bench.model_words), *self._looks(path))


def _show_rest(result: dict[str, Any]) -> None:
    """What the log may be of, its channels, then what belongs into the model file."""
    for sentence in result.get("sentences") or ():
        paragraph(sentence)
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
