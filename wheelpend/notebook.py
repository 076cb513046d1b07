"""Results as a notebook shows them: a sentence and a table, as text and as HTML, and the table as a DataFrame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    import polars as pl

MAX_TEXT_ROWS = 12  # of a table in a repr
SHOWN_DIGITS = 4  # significant ones, of a number that is shown


class ResultTable(NamedTuple):
    """Rows of values under named columns, each of one type; None where a value is not known."""

    columns: Mapping[str, type]
    rows: Sequence[tuple]


class NotebookResult:
    """A result that shows itself in a notebook, and whose table can be had as a DataFrame."""

    def headline(self) -> str:
        """A sentence on the result as a whole."""
        raise NotImplementedError

    def table(self) -> ResultTable:
        """The table that is shown, and that ``to_frame`` returns."""
        raise NotImplementedError

    def to_frame(self) -> pl.DataFrame:
        """The table of the result as a Polars DataFrame, in full precision; null where a value is not known."""
        import polars as pl  # imported late: it is slow to load

        columns, rows = self.table()
        return pl.DataFrame(list(rows), schema=dict(columns), orient="row").fill_nan(None)

    def __repr__(self) -> str:
        lines = [self.headline(), *_aligned(self.table()), *self._remarks()]
        return "\n".join(_visible(line) for line in lines)

    def _repr_html_(self) -> str:
        columns, rows = self.table()
        head = "".join(f"<th>{_html(name)}</th>" for name in columns)
        body = "".join(f"<tr>{''.join(f'<td>{_html(_text(v))}</td>' for v in row)}</tr>" for row in rows)
        table = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>" if rows else ""
        warnings = "".join(f"<li>{_html(w)}</li>" for w in self._warnings)
        return f"<div><p>{_html(self.headline())}</p>{table}{f'<ul>{warnings}</ul>' if warnings else ''}</div>"

    @property
    def _warnings(self) -> tuple[str, ...]:
        return tuple(getattr(self, "warnings", ()))

    def _remarks(self) -> list[str]:
        count = len(self._warnings)
        return [f"{count} warning{'s' if count > 1 else ''}: see .warnings"] if count else []


class DrawnResult(NotebookResult):
    """A result that also has a picture."""

    def plot(self, ax: Any = None) -> Any:
        """Draw the result with matplotlib, and return the Axes, or an array of them where it has several panels.

        ``ax`` are Axes to draw into, as many as there are panels; new ones are made where it is None. Raises Failure
        where matplotlib is not installed, and for another number of Axes.
        """
        from wheelpend import plot  # the public one, found as it is used: it stands above the results

        return plot(self, ax)


def _aligned(table: ResultTable) -> list[str]:
    """The head and the first rows of a table as lines, each column as wide as its widest cell."""
    if not table.rows:
        return []
    cells = [list(table.columns), *([_text(v) for v in row] for row in table.rows[:MAX_TEXT_ROWS])]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    lines = ["  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip() for row in cells]
    left = len(table.rows) - MAX_TEXT_ROWS
    return [*lines, f"... and {left} more: see .to_frame()"] if left > 0 else lines


def _text(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.{SHOWN_DIGITS}g}" if isinstance(value, float) else str(value)


def _html(text: str) -> str:
    return escape(_visible(text))


def _visible(text: str) -> str:
    """A text in which characters that would steer a terminal or turn a text around are written as escapes."""
    return "".join(c if c.isprintable() or c == "\n" else c.encode("unicode_escape").decode() for c in text)
