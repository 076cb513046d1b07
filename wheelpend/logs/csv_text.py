"""Layout of a text table, from its first kilobytes: encoding, separator, decimal mark, comments, names and units."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from wheelpend.errors import Failure
from wheelpend.logs.legend import has_clock, names_of_legend
from wheelpend.logs.units import BRACKETED_TEXT, is_unit, plain_unit

NAMELESS_PREFIX = "column "  # begins the names of the columns of a file without a header
MISSING_CELLS = ("", "nan", "NaN", "NAN", "NA", "N/A", "#N/A", "null", "NULL", "None", "-nan", "-", "--", "?")
SNIFFED_BYTES, SNIFFED_LINES = 65_536, 200  # bytes of a file, and lines of its table in them, that tell its layout
COMMENT_PREFIXES = ("#", "%", "//")
ROW_END = ";"  # behind the rows of a matrix
WHITESPACE = " "  # any number of spaces and tabs between two cells
SEPARATORS = (";", "\t", ",", WHITESPACE)  # the first of those that fit equally well
DECIMAL_COMMA_PATTERN = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
LABELLED_NAMES = re.compile(  # "Columns: t x y", in the languages of most logs
    r"(data )?(columns|columnas|colunas|colonnes|spalten|fields|headers?|variables|channels)\b"
    r"[^:]{0,20}:\s*(?P<names>.+)",
    re.IGNORECASE,
)


class CsvLayout(NamedTuple):
    """How a text table is written."""

    names: list[str]
    units: Mapping[str, str] = {}  # by name, where a row of units stands under the header
    separator: str = ","
    decimal_comma: bool = False
    comment: str = ""  # what comment lines begin with
    skipped: int = 1  # lines before the first row
    row_end: str = ""  # what stands behind the last cell of every row, as in a matrix of MATLAB
    encoding: str = "utf-8"

    @property
    def is_plain(self) -> bool:
        """True of cells between commas, with decimal points, under a header in the first line."""
        return self == CsvLayout(self.names)


class Line(NamedTuple):
    """A line of a table that is no comment, in cells."""

    number: int  # from 0
    cells: list[str]

    @property
    def numbers(self) -> int:
        """How many of its cells are numbers."""
        return sum(map(is_number, self.cells))

    @property
    def texts(self) -> int:
        """How many of its cells are neither numbers nor missing."""
        return sum(c not in MISSING_CELLS and not is_number(c) for c in self.cells)


def csv_layout(path: Path) -> CsvLayout:
    """The layout of a text table; raises Failure where two columns have one name."""
    with path.open("rb") as file:
        head = file.read(SNIFFED_BYTES)
    encoding = find_encoding(head)
    lines = head_lines(head, encoding)
    comment = next((p for p in COMMENT_PREFIXES if any(line.lstrip().startswith(p) for line in lines)), "")
    texts = [(k, line) for k, line in enumerate(lines) if line.strip() and not is_comment(line)][:SNIFFED_LINES]
    if row_end := find_row_end([line for _, line in texts]):
        lines = [line.rstrip().removesuffix(row_end) for line in lines]
        texts = [(k, lines[k]) for k, _ in texts]
    separator = find_separator([line for _, line in texts])
    table = [Line(k, split_cells(line, separator)) for k, line in texts]
    titles, first = find_titles(table)
    rows = table[first : first + 1]
    titles = titles or header_in_comment(lines, rows, separator) or otherwise_separated(texts[:first], rows)
    header = titles[0].cells if titles else []
    width = len(table[first].cells) if first < len(table) else 0
    names = [name or f"{NAMELESS_PREFIX}{k}" for k, name in enumerate(header or [""] * width, 1)]
    units = dict(zip(names, map(plain_unit, titles[1].cells), strict=False)) if len(titles) > 1 else {}
    commas = any(DECIMAL_COMMA_PATTERN.fullmatch(c) for line in table[first:] for c in line.cells)
    skipped = table[first].number if first < len(table) else len(lines)
    return CsvLayout(check_unique(path.name, names), units, separator, commas, comment, skipped, row_end, encoding)


def find_encoding(head: bytes) -> str:
    """UTF-16 by its mark, or by the zeros in every second byte; else UTF-8."""
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    zeros = head[0::2].count(0), head[1::2].count(0)
    if max(zeros) > len(head) // 4 and min(zeros) == 0:  # most characters of a table are ASCII
        return "utf-16-be" if zeros[0] else "utf-16-le"
    return "utf-8"


def head_lines(head: bytes, encoding: str) -> list[str]:
    """Whole lines of a file's head; where it is no UTF-8 its letters are taken for Latin-1."""
    text = head.decode(encoding if encoding != "utf-8" else "utf-8-sig", errors="replace")
    if encoding == "utf-8" and "\ufffd" in text[:-1]:
        text = head.removeprefix(b"\xef\xbb\xbf").decode("latin-1")
    lines = [line.rstrip("\r") for line in text.removeprefix("\ufeff").split("\n")]
    return lines[:-1] if len(head) == SNIFFED_BYTES and len(lines) > 1 else lines


def is_comment(line: str) -> bool:
    """True of a line that begins as comments do."""
    return line.lstrip().startswith(COMMENT_PREFIXES)


def split_cells(line: str, separator: str) -> list[str]:
    """Cells of a line without the spaces around them; raises Failure where it is no line of a table."""
    if separator == WHITESPACE:
        return line.split()
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])]
    except csv.Error as error:  # a carriage return that ends no line, or a cell without end
        raise Failure(
            f"A log must have lines of cells, but one that begins with {line[:20]!r} is none: {error}. "
            r"Save the file with lines that end in \n or \r\n."
        ) from error


def is_number(cell: str) -> bool:
    """True of a number with a decimal point or comma."""
    try:
        float(cell.replace(",", ".") if DECIMAL_COMMA_PATTERN.fullmatch(cell) else cell)
    except ValueError:
        return False
    return cell not in MISSING_CELLS


def find_separator(lines: Sequence[str]) -> str:
    """The separator between which most cells are numbers; without numbers, the one that the first line has most of.

    Of those that do equally well, the one that makes a header fit too: names between tabs may have blanks in them.
    """
    scores = {}
    for separator in SEPARATORS:
        table = [Line(k, split_cells(line, separator)) for k, line in enumerate(lines)]
        usual = usual_width(table)
        fitting = [line for line in table if len(line.cells) == usual > 1]
        if rows := [line for line in fitting if line.numbers]:
            scores[separator] = sum(line.numbers - line.texts for line in rows), len(fitting)
    if scores:
        return max(scores, key=lambda s: scores[s])
    return max(",;\t", key=lines[0].count) if lines else ","


def find_row_end(lines: Sequence[str]) -> str:
    """A semicolon, where every row ends with one, the last of a matrix perhaps not, and none stands between cells.

    Nothing where a row has but one cell without it: then it is what stands between that cell and an empty one.
    """
    texts = [line.rstrip() for line in lines]
    first = next((k for k, text in enumerate(texts) if text.endswith(ROW_END)), len(texts))
    rows = [text.removesuffix(ROW_END) for text in texts[first:]]
    ends = all(text.endswith(ROW_END) for text in texts[first : max(len(texts) - 1, first + 1)])
    if not (rows and ends) or any(ROW_END in text for text in (*texts[:first], *rows)):
        return ""
    separator = find_separator(rows)
    alone = any(DECIMAL_COMMA_PATTERN.fullmatch(r) or len(split_cells(r, separator)) < 2 for r in rows)
    return "" if alone else ROW_END


def usual_width(table: Sequence[Line]) -> int:
    """How many cells most lines have."""
    return Counter(len(line.cells) for line in table).most_common(1)[0][0] if table else 0


def find_titles(table: Sequence[Line]) -> tuple[list[Line], int]:
    """The header, with a row of units under it where there is one, and the index of the first row.

    A second line of names is joined to the first.
    No header is found where numbers stand before all text; without any row of numbers the first line is one. Some of
    its names may be numbers, as those of channels are, if only numbers stand in the rows under it.
    """
    usual = usual_width(table)
    if between := lines_between(table, usual):
        return list(table[:1]), between + 1
    if has_numbered_names(table[:2], usual):
        return list(table[:1]), 1
    for k, line in enumerate(table):
        if line.texts == 0 and line.numbers and len(line.cells) == usual:
            return [], k
        follows = table[k + 1] if k + 1 < len(table) else None
        if not is_title(line, usual) or follows is None or usual not in (len(line.cells), len(follows.cells)):
            continue
        if is_row(follows) or not is_title(follows, len(line.cells)):
            return [line], k + 1
        if len(follows.cells) == len(line.cells):
            if is_row_of_units(follows.cells) and follows.texts <= line.texts:
                return [line, follows], k + 2
            has_two = k + 2 < len(table) and is_row(table[k + 2])
            return ([joined_names(line, follows)], k + 2) if has_two else ([line], k + 1)
    return list(table[:1]), min(1, len(table))


def joined_names(line: Line, follows: Line) -> Line:
    """A header of two lines as one: the channel of a recorder, and what it was set to record."""
    pairs = zip(line.cells, follows.cells, strict=True)
    return Line(line.number, [f"{a} ({b})" if a and b and is_unit(b) else f"{a} {b}".strip() for a, b in pairs])


def lines_between(table: Sequence[Line], width: int) -> int:
    """How many lines of text, of another width, stand between a header on the first line and the first row of numbers.

    A logger writes them there: that it began, or that it was stopped.
    """
    if not table or len(table[0].cells) != width or not table[0].texts or table[0].numbers:
        return 0
    for count, line in enumerate(table[1:]):
        if len(line.cells) == width:
            return count if not line.texts and line.numbers else 0
        if not line.texts:
            return 0
    return 0


def has_numbered_names(lines: Sequence[Line], width: int) -> bool:
    """True of a line of numbers and texts above one of the same width in which no text stands."""
    if len(lines) < 2 or any(len(line.cells) != width for line in lines):
        return False
    return lines[0].texts > 0 and lines[0].numbers > 0 and lines[1].texts == 0 and lines[1].numbers > 0


def is_title(line: Line, width: int) -> bool:
    """True of names without any number among them, as many as a table's lines have cells, or at least two."""
    return line.numbers == 0 and line.texts > 0 and len(line.cells) >= min(2, width)


def is_row(line: Line) -> bool:
    """True of a line in which at least half of the cells are numbers or missing."""
    return line.numbers > 0 and 2 * line.texts <= len(line.cells)


def header_in_comment(lines: Sequence[str], first_row: Sequence[Line], separator: str) -> list[Line]:
    """Names in a comment above the first row: in the last, as numpy.savetxt writes them, or in one "Columns: t x y".

    The last may be a row of units instead, under that of the names. Or in several that begin with the numbers of the
    columns. None where they do not fit the row.
    """
    above = [line.strip() for line in lines[: first_row[0].number] if is_comment(line)] if first_row else []
    if not above:
        return []
    width = len(first_row[0].cells)
    last = [Line(0, split_cells(comment_text(line, separator), separator)) for line in above[-2:]]
    fitting = [len(line.cells) == width and is_title(line, 1) for line in last]
    if all(fitting) and len(last) > 1 and all(map(is_unit, last[1].cells)):
        return last
    if fitting[-1]:
        return last[-1:]
    labelled = (m["names"] for line in reversed(above) if (m := LABELLED_NAMES.fullmatch(comment_text(line, ""))))
    written = (split_cells(names, s) for names in labelled for s in SEPARATORS)
    found = next((cells for cells in written if len(cells) == width and are_names(cells)), [])
    names = found or names_of_legend([comment_text(line, "") for line in above], width)
    return [Line(0, names)] if names else []


def are_names(cells: Sequence[str]) -> bool:
    """True of names, each once and none a number, of which one is a clock's: no word of a sentence is."""
    units = [c for c in cells if BRACKETED_TEXT.fullmatch(c)]
    return has_clock(cells) and not units and is_title(Line(0, list(cells)), 2) and len(set(cells)) == len(cells)


def comment_text(line: str, separator: str) -> str:
    """What a comment says; of "#,t,x" the mark is a name of its own."""
    prefix = next(p for p in COMMENT_PREFIXES if line.startswith(p))
    text = line.lstrip(prefix).strip()
    return prefix + text if separator not in ("", WHITESPACE) and text.startswith(separator) else text


def otherwise_separated(above: Sequence[tuple[int, str]], first_row: Sequence[Line]) -> list[Line]:
    """The header right above the first row, and a row of units, where another separator makes as many cells of them.

    As of a program that writes names between blanks, and numbers between tabs; nothing where there are no such lines.
    """
    width = len(first_row[0].cells) if first_row else 0
    found: list[Line] = []
    for number, text in above[-2:]:
        cells = (split_cells(text, separator) for separator in SEPARATORS)
        fitting = (Line(number, own) for own in cells if len(own) == width > 1)
        line = next((one for one in fitting if is_title(one, width)), None)
        found = [] if line is None else [*found, line]
    has_units = len(found) == 2 and is_row_of_units(found[1].cells)
    return found if has_units else found[-1:]


def is_row_of_units(cells: Sequence[str]) -> bool:
    """True of cells of which at least half are units, those apart that are empty."""
    named = [c for c in cells if c]
    return 2 * sum(map(is_unit, named)) >= len(named)


def table_lines(path: Path, layout: CsvLayout) -> Iterator[str]:
    """Lines of a file from its first row on, as they are."""
    with path.open(encoding=layout.encoding, errors="replace", newline="") as file:
        yield from (line for k, line in enumerate(file) if k >= layout.skipped)


def comment_among_rows(path: Path, layout: CsvLayout) -> str:
    """What the first comment line among the rows begins with; nothing where there is none."""
    lines = (line for line in table_lines(path, layout) if is_comment(line))
    return next((p for line in lines for p in COMMENT_PREFIXES if line.startswith(p)), "")


def uneven_row(path: Path, layout: CsvLayout) -> str:
    """Describe the first row that does not have as many cells as the header, if there is one."""
    width, number = len(layout.names), 0
    kept = (line for line in table_lines(path, layout) if not (layout.comment and line.startswith(layout.comment)))
    try:
        for number, row in enumerate(csv.reader(kept, delimiter=layout.separator), 1):
            if row and len(row) != width:
                decimals = "; if these are decimal commas, export with points, or with semicolons between the cells"
                twice = layout.separator == "," and len(row) == 2 * width
                return f"row {number} has {len(row)}, the header {width}{decimals if twice else ''}"
    except csv.Error:  # a quotation mark that never closes, for instance
        pass
    return ""


def check_unique(log: str, names: list[str]) -> list[str]:
    """Return the names; raises Failure when one is there twice."""
    twice = sorted({n for n in names if names.count(n) > 1})
    if twice:
        raise Failure(f"{log}: column names must differ; {', '.join(twice)} is there more than once. Rename one.")
    return names


def first_line(error: Exception) -> str:
    """The first line of another library's message, without its full stop."""
    return str(error).strip().partition("\n")[0].rstrip(".")
