"""Text folded to a width: no word, number or unit broken, no command that is to be copied."""

import io
import re
import shlex

import pytest
from rich.cells import cell_len
from rich.console import Console

from tests.support import SPARSE_S, run, simulated
from wheelpend import save_log
from wheelpend.campaigns.summary import ParameterAgreement
from wheelpend.campaigns.text import AGREEMENT_COLUMNS, _agreement_cells
from wheelpend.reports import console
from wheelpend.reports.console import print_table
from wheelpend.reports.wrapping import column_blocks, folded_cells, wrapped

WIDTH = 80
COMMANDS = [
    "inspect log.csv", "identify log.csv", "compare log.csv", "residuals log.csv", "effects", "effects slosh",
    "history", "verify", "generate", "add coulomb_drive log.csv", "history", "new .", "identify nowhere.csv",
]  # fmt: skip


def test_a_line_that_fits_is_as_it_was_and_further_lines_are_set_in():
    assert wrapped("  short", 20) == "  short"
    assert wrapped("  one two three four", 12) == "  one two\n    three\n    four"


@pytest.mark.parametrize(
    "whole",
    ["0.816 V", "135 N·m", "33 %", "12 V s²/rad", "0.3 ± 0.01 V", "p = 2e-12", "5 of 8", "`wheelpend diagnose LOG`",
     "82.4 ms", "3 N m", "1.01 σ"],
)  # fmt: skip
def test_what_belongs_together_is_on_one_line(whole):
    for blanks in range(1, 30):
        folded = wrapped(f"{'x' * blanks} {whole} and so on, and so on", 32)
        assert whole in folded.splitlines()[0] or whole in folded.splitlines()[1]


def test_cells_are_folded_at_blanks_and_names_stay_whole():
    rows = [["effect", "what it is", "parameters"], ["coulomb_drive", "Dry friction in the drive", "torque [V s/rad]"]]
    head, cells = folded_cells(rows, 45)
    assert head == rows[0] and cells[0] == "coulomb_drive"
    assert cells[1:] == ["Dry friction\nin the drive", "torque\n[V s/rad]"]
    assert folded_cells(rows, 200) == rows


def test_heads_are_folded_before_what_stands_below_them():
    rows = [["effect", "size", "blocks agree"], ["coulomb_drive", "torque 0.3 ± 0.01 V", "5/5"]]
    head, cells = folded_cells(rows, 50)
    assert head == ["effect", "size", "blocks\nagree"] and cells == rows[1]


def test_a_table_whose_words_are_too_wide_stands_in_blocks_that_each_begin_with_the_names():
    rows = [["parameter", "mean", "spread", "p"], ["coulomb_drive.torque", "-0.00012345", "1.2345e-05", "1.5e-14"]]
    assert column_blocks(rows, 80) == [[0, 1, 2, 3]]
    assert column_blocks(rows, 51) == [[0, 1, 2], [0, 3]]
    assert column_blocks(rows, 20) == [[0, 1], [0, 2], [0, 3]]


def agreement(name, size):
    row = ParameterAgreement(100, size, 1.23e-5 * size, 0.0123 * size, 0.012 * size, 3.2e3, 99, 1.5e-114, None)
    return [name, *_agreement_cells(name, row)[1:]]


@pytest.mark.parametrize("width", [48, 60, 80])
def test_the_table_of_a_campaign_breaks_no_number_and_no_name(width, monkeypatch):
    rows = [agreement(name, size) for name, size in (("presliding_drive.stiffness", -12345.6), ("X1", -1.23e-4))]
    shown = io.StringIO()
    monkeypatch.setattr(console, "out", Console(file=shown, width=width, highlight=False, soft_wrap=True))
    print_table("Parameters over the logs", AGREEMENT_COLUMNS, rows)
    assert all(cell_len(line) <= width for line in shown.getvalue().splitlines())
    assert {word for row in rows for word in row} <= set(words(shown.getvalue().splitlines()))
    assert shown.getvalue().count("Parameters over the logs") == 1


@pytest.fixture(scope="module")
def workspace(tmp_path_factory):
    folder = tmp_path_factory.mktemp("narrow")
    run("new", folder)
    save_log(folder / "log.csv", simulated(duration=4.0, sample=SPARSE_S, coulomb_drive__torque=0.3))
    return folder


def printed(line, monkeypatch, width):
    """Lines that a command prints on a terminal so wide, both its streams."""
    shown = io.StringIO()
    for name in ("out", "err"):
        terminal = Console(file=shown, force_terminal=True, width=width, highlight=False, soft_wrap=True)
        monkeypatch.setattr(console, name, terminal)
    run(*shlex.split(line), code=None)
    plain = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown.getvalue())
    lines = [line.rpartition("\r")[2] for line in plain.splitlines()]
    return [line for line in lines if not re.match("[\u2800-\u28ff] |Took ", line)]  # but for what passes


def words(lines):
    return [word for line in lines for word in re.findall(r"[^\s│┃━┏┓┡┩├┤└┘┴┬╇┳┻─]+", line)]


@pytest.mark.parametrize("line", COMMANDS)
def test_on_80_columns_a_command_prints_no_wider_and_breaks_no_word(line, workspace, monkeypatch):
    monkeypatch.chdir(workspace)
    model = workspace / "model.toml"
    before, narrow = model.read_bytes(), printed(line, monkeypatch, WIDTH)
    model.write_bytes(before)  # `add` changed it
    wide = printed(line, monkeypatch, 1000)
    assert [text for text in narrow if cell_len(re.sub("[\u0300-\u036f]", "", text)) > WIDTH] == []
    assert sorted(set(words(narrow)) - set(words(wide))) == []
