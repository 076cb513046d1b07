"""The next log: limits as sliders, what it is to tell apart, and the command as it was designed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from nicegui import ui

from derive.plant_signature import PlantSignature
from wheelpend.errors import Failure
from wheelpend.experiments.recommendation import USUAL_TILT_RAD
from wheelpend.simulation.references import BUILT_IN_DURATION_S, read_trajectory, trajectory_columns
from wheelpend.view.bench import Bench, Words
from wheelpend.view.panel import action, paragraph, set_enabled
from wheelpend.view.time_chart import Line, Pane, TimeChart

MAX_TILT_RAD = 1.5  # of the slider; a plant's own range ends before
LIMIT_FACTOR = 3.0  # from a usual limit to the largest that the slider offers
MAX_DURATION_S = 120.0
SLIDER_STEPS = 100
NO_PAIR = "what the logs leave open"
COMMAND_COLOUR = "#2f86d6"
COMMAND_FILE = "designed.csv"


class DesignForm:
    """Sliders that say what a designed command may ask of the machine."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self.plant = ""
        self.usual = (USUAL_TILT_RAD, 0.0)
        with ui.element("div").classes("limits"):
            self.tilt, self.tilt_words = _slider("Largest angle from upright, in rad", MAX_TILT_RAD, USUAL_TILT_RAD)
            self.input, self.input_words = _slider("Largest input", 1.0, 1.0)
            self.duration, self.duration_words = _slider("Length, in s", MAX_DURATION_S, BUILT_IN_DURATION_S)
        for slider in (self.tilt, self.input, self.duration):
            slider.on("update:model-value", self._say_values)
        with ui.element("div").classes("buttons"):
            self.pair = ui.select([NO_PAIR], value=NO_PAIR, label="It is to tell").props("outlined dense")
            self.pair.classes("choice")
            self.start = action(
                "Design the next log",
                lambda: bench.run(self.words()),
                describes="Design the next log within these limits",
            )

    def update(self) -> None:
        """Offer the limits of the plant, and the effects that the diagnosis cannot tell apart."""
        model = self.bench.model()
        set_enabled(self.start, self.bench.can_judge and model is not None and model.plant_signature.is_balanced)
        if model is not None and model.plant != self.plant:
            self.plant = model.plant
            self._take_plant(model.plant_signature)
        found = self.bench.current("diagnose")
        options = [NO_PAIR, *pairs_to_tell(found.result if found else {})]
        if options != self.pair.options:
            self.pair.set_options(options, value=self.pair.value if self.pair.value in options else NO_PAIR)

    def words(self) -> Words:
        """The command, with those limits that are not the plant's own."""
        said: list[str] = []
        if self.pair.value != NO_PAIR:
            said += ["--between", str(self.pair.value).replace(" or ", ",")]
        limits = (("--pitch-limit", self.tilt, self.usual[0]), ("--voltage-limit", self.input, self.usual[1]))
        for option, slider, usual in (*limits, ("--duration", self.duration, BUILT_IN_DURATION_S)):
            if abs(float(slider.value) - usual) > 1e-9:
                said += [option, f"{float(slider.value):g}"]
        return ("design", *said, "-o", COMMAND_FILE, *self.bench.fitted_files)

    def _take_plant(self, plant: PlantSignature) -> None:
        self.usual = plant.usual_limits or (USUAL_TILT_RAD, 0.0)
        tilt, size = self.usual
        _set_range(self.tilt, min(MAX_TILT_RAD, LIMIT_FACTOR * tilt), tilt)
        _set_range(self.input, LIMIT_FACTOR * size or 1.0, size)
        self.names = plant.words.controlled or plant.range_channel, plant.input_word, plant.input_unit
        self._say_values()

    def _say_values(self) -> None:
        controlled, word, unit = self.names
        self.tilt_words.set_text(f"{controlled}: at most {float(self.tilt.value):g} rad")
        size = float(self.input.value)
        self.input_words.set_text(f"{word}: at most {size:g} {unit}" if size else f"{word}: at most what the logs show")
        self.duration_words.set_text(f"for {float(self.duration.value):g} s")


def pairs_to_tell(result: Mapping[str, Any]) -> list[str]:
    """Pairs of effects that a diagnosis cannot tell apart, the likeliest first."""
    candidates = result.get("candidates") or []
    return [f"{c['effect']} or {other}" for c in candidates for other in c.get("equivalent_to") or ()][:12]


def show_design(bench: Bench, result: Mapping[str, Any]) -> None:
    """The designed command, drawn from its file; a sentence where that cannot be read any more."""
    model = bench.model()
    if model is None:
        return
    try:
        t, value, rate = read_trajectory(bench.folder / str(result["file"]), model.table)
    except (Failure, OSError, KeyError) as failure:
        paragraph(str(failure))
        return
    names = trajectory_columns(model.table)
    panes = [_pane(name, values) for name, values in zip(names, (value, rate), strict=True)]
    describes = f"The designed command, {names[0]} and its rate over {np.ptp(t):g} s"
    TimeChart(t, panes, describes, "The command as it was designed: have the machine follow it, and log what happens.")


def _pane(name: str, values: np.ndarray) -> Pane:
    return Pane(name, (Line(lambda window: values[window], COMMAND_COLOUR),))


def _slider(describes: str, largest: float, value: float) -> tuple[ui.slider, ui.label]:
    """A slider with the words that say where it stands."""
    with ui.element("div").classes("limit"):
        words = ui.label().classes("plain")
        slider = ui.slider(min=0.0, max=largest, step=largest / SLIDER_STEPS, value=value)
        slider.props["aria-label"] = describes
    return slider, words


def _set_range(slider: ui.slider, largest: float, value: float) -> None:
    slider.props["min"] = slider.props["step"] = float(f"{largest / SLIDER_STEPS:.3g}")
    slider.props["max"] = largest
    slider.set_value(value)
    slider.update()
