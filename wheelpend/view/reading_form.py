"""How each quantity of a log and each sensor is read, as fields that can be corrected."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from nicegui import ui

from wheelpend.view.corrections import changed
from wheelpend.view.panel import text

SIGN_CHOICES = {1: "as it is", -1: "turned round"}
OWN_UNIT = ""  # stands for the quantity's own
NUMBER_FIELDS = {"scale": 1.0, "offset": 0.0}  # with what goes without saying


class ReadingForm:
    """A group of fields for each quantity, and one for the sensors."""

    def __init__(self, log: Mapping[str, Any]) -> None:
        self.before: dict[str, Any] = {}
        self.fields: dict[str, Any] = {}
        for quantity in log["quantities"]:
            self._show_quantity(quantity, log["columns"])
        with self._group("Sensors"):
            for sensor in log["sensors"]:
                self._show_sensor(sensor)

    def settings(self) -> dict[str, Any]:
        """What `wheelpend set` makes of the fields, where the model file states something else; empty takes out."""
        return changed({key: self._value(key) for key in self.fields}, self.before)

    def _value(self, key: str) -> Any:
        value = self.fields[key].value
        ending = key.rpartition(".")[2]
        if key.startswith("columns.") and ending in NUMBER_FIELDS and str(value or "").strip() == "":
            return NUMBER_FIELDS[ending]
        return value if not isinstance(value, str) else value.strip() or None

    @staticmethod
    def _group(title: str, remark: str = "") -> ui.element:
        group = ui.element("fieldset").classes("reading")
        with group, ui.element("legend"):
            text(f"{title}{remark}")
        return group

    def _show_quantity(self, quantity: Mapping[str, Any], columns: Sequence[str]) -> None:
        name = quantity["name"]
        there = quantity["column"] in columns
        remark = ", guessed" if quantity["is_guessed"] else "" if there else ", not in the log"
        if not there and not quantity["is_required"]:
            remark = ", optional"
        with self._group(f"{name} [{quantity['own_unit']}]", remark):
            options = list(dict.fromkeys([*columns, quantity["column"]]))
            own = quantity["own_unit"]
            units = {OWN_UNIT: own} | {u: u for u in quantity["units"] if u != own or u == quantity["unit"]}
            self._choose(name, "column", options, quantity)
            self._choose(name, "unit", units, quantity)
            self._choose(name, "sign", SIGN_CHOICES, quantity)
            for key in NUMBER_FIELDS:
                self._keep(
                    f"columns.{name}.{key}", quantity["stated"][key], ui.input(key, value=str(quantity[key])), name
                )

    def _choose(self, name: str, key: str, options: Any, quantity: Mapping[str, Any]) -> None:
        self._keep(
            f"columns.{name}.{key}", quantity["stated"][key], ui.select(options, value=quantity[key], label=key), name
        )

    def _show_sensor(self, sensor: Mapping[str, Any]) -> None:
        value, choices = sensor["value"], sensor.get("choices")
        if choices:
            self._keep(sensor["key"], value, ui.select(choices, value=value, label=sensor["label"]), sensor["label"])
        else:
            self._keep(sensor["key"], value, ui.input(sensor["label"], value=str(value)), sensor["label"])

    def _keep(self, key: str, before: Any, field: Any, name: str) -> None:
        self.fields[key], self.before[key] = field, None if before == "" else before
        ending = key.rpartition(".")[2]
        is_sensor = key.startswith("sensors.")
        field.props("outlined dense").classes(
            "reading-field long" if is_sensor or ending == "column" else "reading-field"
        )
        field.props["aria-label"] = name if is_sensor else f"{ending} of {name}"
