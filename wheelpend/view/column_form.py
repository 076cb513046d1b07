"""How each quantity is read from a log, to be corrected."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from nicegui import ui

from wheelpend.errors import Failure
from wheelpend.logs.columns import UNIT_CONVERSIONS, ColumnMap
from wheelpend.view.panel import action, text

OWN_UNIT = "its own"
TURNED_ROUND = "turned round"
COUNTS_ALONG = "as it is"


class ColumnForm:
    """A row for each quantity: its column, unit, sign, scale and zero."""

    def __init__(
        self,
        maps: Mapping[str, ColumnMap],
        guessed: Sequence[str],
        columns: Sequence[str],
        apply: Callable[[dict[str, ColumnMap]], object],
    ) -> None:
        self.maps, self.fields = maps, dict[str, dict[str, Any]]()
        with ui.element("div").classes("wide"), ui.element("table"):
            with ui.element("thead"), ui.element("tr"):
                for head in ("quantity", "column", "unit", "sign", "times", "plus"):
                    with ui.element("th").props('scope="col"'):
                        text(head)
            with ui.element("tbody"):
                for name, found in maps.items():
                    self._row(name, found, name in guessed, columns)
        self.button = action(
            "Read it so", lambda: self._apply(apply), describes="Write how the log is read into the model file"
        )

    def _row(self, name: str, found: ColumnMap, is_guessed: bool, columns: Sequence[str]) -> None:
        options = [*columns, *([found.column] if found.column not in columns else [])]
        with ui.element("tr"):
            with ui.element("th").props('scope="row"'):
                text(f"{name} (guessed)" if is_guessed else name)
            self.fields[name] = {
                "column": _field(ui.select, f"Column of {name}", options, value=found.column),
                "unit": _field(
                    ui.select, f"Unit of {name}", [OWN_UNIT, *UNIT_CONVERSIONS], value=found.unit or OWN_UNIT
                ),
                "sign": _field(
                    ui.select, f"Sign of {name}", [COUNTS_ALONG, TURNED_ROUND],
                    value=TURNED_ROUND if found.sign < 0 else COUNTS_ALONG,
                ),
                "scale": _field(ui.number, f"Scale of {name}", value=found.scale),
                "offset": _field(ui.number, f"Zero of {name}", value=found.offset),
            }  # fmt: skip

    def _apply(self, apply: Callable[[dict[str, ColumnMap]], object]) -> None:
        try:
            apply({name: self._chosen(name) for name in self.maps})
        except Failure as failure:
            ui.notify(str(failure), type="negative")

    def _chosen(self, name: str) -> ColumnMap:
        """The column that the user chose; raises Failure where that is none."""
        fields = {key: field.value for key, field in self.fields[name].items()}
        unit = "" if fields["unit"] == OWN_UNIT else str(fields["unit"])
        sign = -1 if fields["sign"] == TURNED_ROUND else 1
        if fields["scale"] is None or fields["offset"] is None:
            raise Failure(f"{name} must be read with numbers, but a field of it is empty. 1 and 0 change nothing.")
        scale, offset = float(fields["scale"]), float(fields["offset"])
        return ColumnMap(str(fields["column"]), unit, sign, scale, offset, self.maps[name].times)


def _field(kind: Callable[..., Any], label: str, *arguments: Any, **options: Any) -> Any:
    """A field in a cell of its own, with a label for those who do not see the table."""
    with ui.element("td"):
        field = kind(*arguments, **options).props("dense outlined").classes("cell")
        field.props["aria-label"] = label
    return field
