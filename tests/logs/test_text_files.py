"""Text files as people have them: comments, decimal commas, separators, encodings, units, no header."""

import numpy as np
import pytest

from wheelpend.errors import Failure
from wheelpend.logs.columns import ColumnMap
from wheelpend.logs.csv_text import csv_layout, is_unit, plain_unit
from wheelpend.logs.read import load_log

NAMES = ["t", "v_in", "theta_w", "theta_p", "dtheta_p"]


def values(n=40):
    """Numbers (n, 5) of a plausible log, with signs and exponents."""
    k = np.arange(n)
    return np.column_stack([0.01 * k, (-1.5) ** (k % 2), 0.1 * k, 1e-5 * k - 0.02, 0.02 * np.sin(k)])


def text(separator=",", header=True, decimal="."):
    """The log as text."""
    rows = [separator.join(f"{v:.9g}".replace(".", decimal) for v in row) for row in values()]
    return "\n".join([*([separator.join(NAMES)] if header else []), *rows]) + "\n"


def read(folder, content, columns=None, encoding="utf-8"):
    """The log of a text file."""
    path = folder / "log.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode(encoding))
    return load_log(path, columns)


def assert_same(log, warnings=()):
    """The log holds the numbers, and nothing odd is said of it."""
    np.testing.assert_allclose(np.column_stack([log.t, log.voltage, log.measured]), values(), rtol=1e-8, atol=1e-12)
    assert log.warnings == warnings


@pytest.mark.parametrize("prefix", ["#", "%", "//"])
def test_comments_before_the_header_and_among_the_rows_are_passed_over(tmp_path, prefix):
    lines = text().splitlines()
    lines[20:20] = [f"{prefix} the motor was warm, 3, 4"]
    assert_same(read(tmp_path, "\n".join([f"{prefix} bench 3, run 7", prefix, "", *lines])))


@pytest.mark.parametrize("separator", [",", "  "])
def test_a_comment_that_comes_late_is_passed_over(tmp_path, monkeypatch, separator):
    monkeypatch.setattr("wheelpend.logs.csv_text.SNIFFED_BYTES", 200)
    lines = text(separator).splitlines()
    lines[35:35] = ["# restarted"]
    assert_same(read(tmp_path, "\n".join(lines)))


@pytest.mark.parametrize("separator", [";", "\t", " ", "   ", " \t"])
@pytest.mark.parametrize("decimal", [".", ","])
@pytest.mark.parametrize("header", [True, False])
def test_separators_and_decimal_commas_are_recognised(tmp_path, separator, decimal, header):
    columns = None if header else {name: ColumnMap(f"column {k}") for k, name in enumerate(NAMES, 1)}
    assert_same(read(tmp_path, text(separator, header, decimal), columns))


def test_quoted_decimal_commas_between_commas_are_read(tmp_path):
    rows = [",".join(f'"{v:.9g}"'.replace(".", ",") for v in row) for row in values()]
    assert_same(read(tmp_path, "\n".join([",".join(NAMES), *rows])))


def test_decimal_commas_between_commas_are_named_with_the_cure(tmp_path):
    with pytest.raises(Failure, match=r"row 1 has 10, the header 5; if these are decimal commas, export with points"):
        rows = [",".join(f"{v:.3f}".replace(".", ",") for v in row) for row in values()]
        read(tmp_path, "\n".join([",".join(NAMES), *rows]))


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
def test_every_encoding_of_unicode_is_read(tmp_path, encoding):
    assert_same(read(tmp_path, "# Prüfstand\n" + text(";", decimal=","), encoding=encoding))


def test_utf_16_with_a_mark_in_the_other_order_is_read(tmp_path):
    assert_same(read(tmp_path, b"\xfe\xff" + text().encode("utf-16-be")))


def test_a_large_file_in_utf_16_is_refused_with_the_command_that_converts_it(tmp_path, monkeypatch):
    monkeypatch.setattr("wheelpend.logs.polars_files.MAX_RECODED_BYTES", 100)
    with pytest.raises(Failure, match=r"iconv -f UTF-16 -t UTF-8 log\.csv"):
        read(tmp_path, text(), encoding="utf-16")


def test_latin_1_in_comments_and_names_is_read(tmp_path):
    content = "# Prüfstand 3, 20 °C\n" + text().replace("theta_p,", "Winkel [°],", 1)
    assert_same(read(tmp_path, content, {"theta_p": ColumnMap("Winkel [°]")}, encoding="latin-1"))


def test_the_header_that_numpy_writes_into_a_comment_is_read(tmp_path):
    np.savetxt(tmp_path / "saved.csv", values(), delimiter=",", header=",".join(NAMES))
    assert_same(load_log(tmp_path / "saved.csv"))
    np.savetxt(tmp_path / "spaced.txt", values(), header=" ".join(NAMES))
    assert_same(load_log(tmp_path / "spaced.txt"))


@pytest.mark.parametrize("label", ["Columns", "columnas (SI)", "Headers", "Data fields"])
def test_names_in_a_comment_that_says_so_are_read(tmp_path, label):
    names = f"# Rig 3: of 2025\n# {label}: {' '.join(NAMES)}\n# gain = 3, 1\n#\n"
    rows = "".join(" ".join(f"{v:.12g}" for v in row) + "\n" for row in values())
    assert_same(read(tmp_path, names + rows))
    assert_same(read(tmp_path, names.replace(" ".join(NAMES), ", ".join(NAMES)) + rows))


@pytest.mark.parametrize(
    "comment",
    [
        "Author: A B C D E",
        "Columns: t v_in theta_w",
        "a b c d: 3 4 5 6 7",
        "Columns: one row per sample each",
        "Variables: float float float float t",
        "Channels: t [s] u [V] x",
        "Format: t v_in theta_w theta_p dtheta_p",
    ],
)
def test_other_comments_with_a_colon_are_no_header(tmp_path, comment):
    content = f"# {comment}\n#\n" + text().split("\n", 1)[1]
    log = read(tmp_path, content, {n: ColumnMap(f"column {k}") for k, n in enumerate(NAMES, 1)})
    assert_same(log)


def test_lines_of_a_logger_before_the_header_are_passed_over(tmp_path):
    assert_same(read(tmp_path, "Logger v1.2\nDate;2024-05-01\nChannels;5\n\n" + text(";")))


def test_a_row_of_units_converts_what_is_in_other_units(tmp_path):
    scaled = values() * [1e3, 1e3, 1, 180 / np.pi, 1]
    rows = [";".join(f"{v:.12g}" for v in row) for row in scaled]
    log = read(tmp_path, "\n".join([";".join(NAMES), "[ms];[mV];[rad];[°];[foo]", *rows]))
    remarks = [f"{c} is in {u} by the file's row of units, and is converted to {o}."
               for c, u, o in (("t", "ms", "s"), ("v_in", "mV", "V"), ("theta_p", "deg", "rad"))]  # fmt: skip
    assert_same(log, (*remarks, "dtheta_p is in 'foo' by the file's row of units; it is read as rad/s."))


def test_names_and_units_in_comments_above_a_matrix_are_read(tmp_path):
    scaled = values() * [1e3, 1, 1, 180 / np.pi, 1]
    rows = [",".join(f"{v:.12g}" for v in row) + ";" for row in scaled]
    above = ["%Bench 3", "%Date:,02/04/2021", "", "%" + ",".join(NAMES), "%[ms],[V],[rad],[deg],[rad/s]"]
    log = read(tmp_path, "\n".join([*above, *rows]))
    remarks = [f"{c} is in {u} by the file's row of units, and is converted to {o}."
               for c, u, o in (("t", "ms", "s"), ("theta_p", "deg", "rad"))]  # fmt: skip
    assert_same(log, tuple(remarks))


@pytest.mark.parametrize(("separator", "end"), [(",", ";"), (" ", ";"), ("\t", " ; "), (",", ";\r")])
@pytest.mark.parametrize("header", [";", ""])
def test_a_semicolon_behind_every_row_is_none_of_its_cells(tmp_path, separator, end, header):
    lines = text(separator).splitlines()
    assert_same(read(tmp_path, "\n".join([lines[0] + header, *(line + end for line in lines[1:])])))


def test_the_last_row_of_a_matrix_and_titles_above_it_may_lack_the_semicolon(tmp_path):
    lines = text().splitlines()
    rows = [line + ";" for line in lines[1:-1]] + lines[-1:]
    assert_same(read(tmp_path, "\n".join(["% bench 3", "", "% " + lines[0] + ";", *rows])))
    assert_same(read(tmp_path, "\n".join(["Bench", "Run 7", "3rd of May", lines[0], *rows])))


@pytest.mark.parametrize("decimal", [".", ","])
@pytest.mark.parametrize("header", ["t;dtheta_p\n", ""])
def test_a_semicolon_before_a_cell_that_stays_empty_ends_no_row(tmp_path, decimal, header):
    path = tmp_path / "log.csv"
    path.write_text(header + "".join(f"{0.01 * k:.2f};\n".replace(".", decimal) for k in range(300)))
    layout = csv_layout(path)
    assert layout.row_end == "" and layout.separator == ";" and len(layout.names) == 2


@pytest.mark.parametrize("names", ["t V A", "time V rad"])
def test_a_title_above_names_that_might_be_units_is_no_header(tmp_path, names):
    path = tmp_path / "log.txt"
    path.write_text(f"# motor test three\n# {names}\n" + "".join(f"{0.01 * k:.2f} {k} 1\n" for k in range(50)))
    assert csv_layout(path).names == names.split()


def test_semicolons_between_the_cells_are_no_end_of_a_row(tmp_path):
    lines = text(";").splitlines()
    log = read(tmp_path, "\n".join([lines[0] + ";more", *(line + ";" for line in lines[1:])]))
    np.testing.assert_allclose(log.measured[:, -1], values()[:, -1], rtol=1e-8)
    assert csv_layout(tmp_path / "log.csv").row_end == ""


def test_a_large_file_with_semicolons_behind_its_rows_is_refused_with_the_command_that_removes_them(
    tmp_path, monkeypatch
):
    monkeypatch.setattr("wheelpend.logs.polars_files.MAX_RECODED_BYTES", 100)
    with pytest.raises(Failure, match=r"a ; does. Remove it: sed 's/;\\s\*\$//' log\.csv"):
        read(tmp_path, text().replace("\n", ";\n"))


def test_rows_in_which_nothing_stands_are_left_out_and_told(tmp_path):
    lines = text().splitlines()
    lines[21:21] = ["nan,nan,nan,nan,nan", ",,,,"]
    told = "2 rows in which nothing stands are left out, the first of them row 21."
    assert_same(read(tmp_path, "\n".join(lines)), (told,))
    with pytest.raises(Failure, match="every sample needs its time; row 21 of t has none"):
        read(tmp_path, "\n".join([*lines[:21], "nan,1.5,nan,nan,nan", *lines[23:]]))


@pytest.mark.parametrize(
    ("written", "unit"),
    [("degrees/second", "deg/s"), ("deg per sec", "deg/s"), ("Radians", "rad"), ("(milliseconds)", "ms"),
     ("Volts", "V"), ("meters/s", "m/s"), ("rad/s", "rad/s"), ("m/s^2", "m/s^2"), ("meters/second²", "m/s²"),
     ("cm", "cm"), ("s", "s"), ("ms", "ms"), ("-", "")],
)  # fmt: skip
def test_units_may_be_written_out(written, unit):
    assert is_unit(written) and plain_unit(written) == unit


@pytest.mark.parametrize("name", ["speed", "mass", "theta_w", "position", "amps_left", "seconds left", "pos", "class"])
def test_names_are_no_units(name):
    assert not is_unit(name)


def test_a_row_of_units_in_words_converts_too(tmp_path):
    scaled = values() * [1e3, 1.0, 1.0, 180 / np.pi, 1.0]
    rows = [",".join(f"{v:.12g}" for v in row) for row in scaled]
    log = read(tmp_path, "\n".join([",".join(NAMES), "milliseconds,Volts,radians,Degrees,rad/s", *rows]))
    remarks = [f"{c} is in {u} by the file's row of units, and is converted to {o}."
               for c, u, o in (("t", "ms", "s"), ("theta_p", "deg", "rad"))]  # fmt: skip
    assert_same(log, tuple(remarks))


@pytest.mark.parametrize("units", ["s,State,rad,State,", "s,V,rad,rad,things"])
def test_a_row_of_which_half_are_units_is_one_of_units(tmp_path, units):
    path = tmp_path / "log.csv"
    path.write_text("\n".join([",".join(NAMES), units, "", *text(",", header=False).splitlines()]))
    layout = csv_layout(path)
    assert layout.names == list(NAMES) and layout.units["t"] == "s"
    assert not {"State", "things"} & set(layout.units.values())
    assert_same(read(tmp_path, path.read_text()))


def test_two_rows_of_names_are_one_header(tmp_path):
    above = ["Axis1", "Number of sampling data,40", "Time,Analog 1,Analog 2,Analog 3,Analog 4",
             "s,v_in,Servo motor speed,Not selected,Not selected"]  # fmt: skip
    path = tmp_path / "log.csv"
    path.write_text("\n".join([*above, *text(",", header=False).splitlines()]))
    names = ["Time (s)", "Analog 1 v_in", "Analog 2 Servo motor speed"]
    layout = csv_layout(path)
    assert layout.names == [*names, "Analog 3 Not selected", "Analog 4 Not selected"] and not layout.units
    both = dict(zip(NAMES, layout.names, strict=True))
    assert_same(read(tmp_path, path.read_text(), {n: ColumnMap(c) for n, c in both.items()}))


@pytest.mark.parametrize(("between", "rows"), [("  ", "\t"), (",", "\t"), ("\t", ","), (";", ",")])
def test_a_header_may_be_separated_otherwise_than_the_rows(tmp_path, between, rows):
    assert_same(read(tmp_path, "\n".join([between.join(NAMES), *text(rows, header=False).splitlines()])))


@pytest.mark.parametrize("beside", ["", "note to no number"])
def test_names_between_tabs_may_have_blanks_in_them(tmp_path, beside):
    named = ["t (in seconds)", *NAMES[1:], *([beside] if beside else [])]
    rows = [row + ("\t0.1" if beside else "") for row in text("\t", header=False).splitlines()]
    assert_same(read(tmp_path, "\n".join(["\t".join(named), *rows]), {"t": ColumnMap("t (in seconds)")}))


def test_a_row_of_units_may_be_separated_as_its_header(tmp_path):
    lines = ["Logger v1.2", " ".join(NAMES), "s V rad rad rad/s", *text("\t", header=False).splitlines()]
    assert_same(read(tmp_path, "\n".join(lines)))


@pytest.mark.parametrize("above", ["Logger v1.2", "a log of my robot, in May", "1 2 3 4 5", "t"])
def test_what_stands_above_rows_without_a_header_is_none(tmp_path, above):
    path = tmp_path / "log.csv"
    path.write_text("\n".join([above, *text("\t", header=False).splitlines()]))
    assert csv_layout(path).names == [f"column {k}" for k in range(1, 6)]


def test_a_unit_in_the_model_goes_before_the_row_of_units(tmp_path):
    lines = text(";").splitlines()
    content = "\n".join([lines[0], "s;V;rad;deg;rad/s", *lines[1:]])
    assert_same(read(tmp_path, content, {"theta_p": ColumnMap("theta_p", "rad")}))


def test_a_file_without_a_header_is_refused_with_its_columns_by_number(tmp_path):
    with pytest.raises(Failure, match="The file has, without a header: column 1, column 2, column 3, column 4, col"):
        read(tmp_path, text(header=False))


def test_uneven_rows_between_spaces_are_refused(tmp_path):
    lines = text(" ").splitlines()
    lines[12] = " ".join(lines[12].split()[:4])
    with pytest.raises(Failure, match=r"row 12 has 4, the header 5\. Write nan where a sensor gave no value"):
        read(tmp_path, "\n".join(lines))


def test_a_first_row_that_is_uneven_is_named(tmp_path):
    lines = text().splitlines()
    lines[1] += ",7"
    with pytest.raises(Failure, match="row 1 has 6, the header 5"):
        read(tmp_path, "\n".join(lines))


def test_a_header_that_is_written_again_is_named(tmp_path):
    lines = text().splitlines()
    with pytest.raises(Failure, match="row 31 of column t has 't'"):
        read(tmp_path, "\n".join([*lines[:31], lines[0], *lines[31:]]))


def test_formulas_and_text_in_further_columns_are_never_looked_at(tmp_path):
    lines = text().splitlines()
    remarked = [lines[0] + ",remark", *(f'{line},"=SYSTEM(1); a, b"' for line in lines[1:])]
    assert_same(read(tmp_path, "\n".join(remarked)))


def test_only_the_head_of_a_file_is_read_for_its_layout(tmp_path, monkeypatch):
    path = tmp_path / "log.csv"
    path.write_text(text())
    layout = csv_layout(path)
    monkeypatch.setattr("wheelpend.logs.csv_text.SNIFFED_BYTES", 150)
    assert csv_layout(path) == layout
    assert layout.is_plain


@pytest.mark.parametrize("header", ["t,0,1,2,3", "0,t,1,v_in,2"])
def test_a_header_may_have_numbers_among_its_names(tmp_path, header):
    path = tmp_path / "log.csv"
    path.write_text("\n".join([header, *text(header=False).splitlines()]))
    assert csv_layout(path).names == header.split(",")
    path.write_text(text(header=False))
    assert csv_layout(path).names == [f"column {k}" for k in range(1, 6)]


def test_a_header_that_begins_with_a_number_sign_keeps_that_name(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("#,t,v_in,theta_w,theta_p\n" + text(header=False))
    assert csv_layout(path).names == ["#", "t", "v_in", "theta_w", "theta_p"]


def test_a_line_that_a_logger_writes_under_the_header_is_no_header_and_no_row(tmp_path):
    path, rows = tmp_path / "log.csv", text(header=False).splitlines()
    path.write_text("\n".join(["t,0,theta_w,v_in,theta_p".replace("0", "n"), "Stopped. Rows: 3, Time: 30 ms", *rows]))
    layout = csv_layout(path)
    assert layout.names == ["t", "n", "theta_w", "v_in", "theta_p"] and layout.skipped == 2
