"""What was searched for before is taken up, and only where nothing that decides the answer has changed."""

import pickle
import shutil
from pathlib import Path

import pytest

import wheelpend.api
from tests.support import ROOT, SPARSE_S, run, simulated
from wheelpend import Model, save_log
from wheelpend.cli import kept_searches
from wheelpend.errors import Failure
from wheelpend.kernels import kept_records
from wheelpend.kernels.cache_folder import cache_folder
from wheelpend.kernels.sealed_files import write_sealed

EFFECT_OF_MINE = """
[worn_brushes]
family = "drive"
sentence = "Brushes that drag more, the faster they go, up to a limit."
on = "drive"
law = "torque*tanh(speed/width)"
dissipates = true
[worn_brushes.parameters]
torque = { unit = "V", minimum = 0, typical = 0.3 }
width = { unit = "rad/s", minimum = 0.05, typical = 3.0, starts = [1.0, 3.0, 8.0] }
"""


@pytest.fixture()
def workspace(tmp_path, monkeypatch):
    """A workspace with a log, and a cache for its searches alone."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv(kept_searches.KEPT_VARIABLE, "6")
    (tmp_path / "cache").mkdir(mode=0o700)
    monkeypatch.setattr(kept_records, "record_folder", lambda: tmp_path / "cache")
    run("new")
    save_log(tmp_path / "log.csv", simulated(duration=4.0, sample=SPARSE_S, coulomb_drive__torque=0.3))
    return tmp_path


def counted(monkeypatch, module, name):
    """The searches that are made from here on."""
    made, search = [], getattr(module, name)
    monkeypatch.setattr(module, name, lambda *given, **named: made.append(name) or search(*given, **named))
    return made


@pytest.mark.slow
def test_report_and_save_take_up_what_explain_found(workspace, monkeypatch):
    searches = counted(monkeypatch, wheelpend.api, "explain")
    said = run("explain", "log.csv")
    again = run("report", "log.csv", "-o", "taken_up.html")
    assert len(searches) == 1
    assert kept_searches.KEPT_SENTENCE in again.stderr and kept_searches.KEPT_SENTENCE not in said.stderr
    saved = run("explain", "log.csv", "--save")
    assert len(searches) == 1 and saved.stdout.startswith(said.stdout.splitlines()[0])
    assert '"coulomb_drive"' in Path("model.toml").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_page_of_what_was_taken_up_is_that_of_a_search(workspace, monkeypatch):
    run("explain", "log.csv")
    run("report", "log.csv")
    shutil.move("report.html", "taken_up.html")
    monkeypatch.setenv(kept_searches.KEPT_VARIABLE, "0")
    run("report", "log.csv")
    assert Path("report.html").read_text(encoding="utf-8") == Path("taken_up.html").read_text(encoding="utf-8")


def asked(kind="ladder", holdout=(), search=None, **options):
    """Ask for what a search finds, which is made anew or taken up."""
    found = search or (lambda *given, **named: "found")
    return kept_searches.searched(
        kind, found, Model.open(), ([Path("log.csv")], list(holdout)), options, lambda text: None
    )


@pytest.fixture()
def searches(workspace):
    """How many searches a question takes that was asked before."""
    made = []

    def again(**question):
        made.clear()
        asked(**question, search=lambda *given, **named: made.append(1) or "found")
        return len(made)

    return again


def test_the_same_question_is_searched_for_once(searches):
    assert [searches(), searches()] == [1, 0]


def test_every_option_is_another_question(searches):
    searches()
    assert searches(without=["stribeck_drive"]) == searches(law=True) == searches(kind="diagnosis") == 1
    shutil.copy("log.csv", "other.csv")
    assert searches(holdout=[Path("other.csv")]) == 1
    assert searches(without=["stribeck_drive"]) == searches() == 0


def test_another_log_of_the_same_name_is_another_question(searches):
    searches()
    text = Path("log.csv").read_text(encoding="utf-8")
    Path("log.csv").write_text(text.replace("1", "2", 1), encoding="utf-8")
    assert searches() == 1
    Path("log.csv").write_text(text, encoding="utf-8")
    assert searches() == 0


def test_a_changed_model_is_another_question(searches):
    searches()
    model = Path("model.toml").read_text(encoding="utf-8")
    Path("model.toml").write_text(model.replace("[constants]", "[constants]  # mine", 1), encoding="utf-8")
    assert [searches(), searches()] == [1, 0]


def test_an_effect_of_ones_own_is_another_question(searches):
    searches()
    Path("effects.toml").write_text(EFFECT_OF_MINE, encoding="utf-8")
    assert [searches(), searches()] == [1, 0]
    Path("effects.toml").write_text(EFFECT_OF_MINE.replace("tanh", "atan"), encoding="utf-8")
    assert [searches(), searches()] == [1, 0]


def test_another_release_searches_anew(searches, monkeypatch):
    searches()
    monkeypatch.setattr(kept_searches, "_program_fingerprint", lambda: "another release")
    assert searches() == 1


def test_the_files_of_a_folder_decide_as_one_file_does(searches, monkeypatch):
    monkeypatch.setattr(kept_searches, "_program_fingerprint", lambda: "a release")
    Path("bag").mkdir()
    Path("bag", "part.mcap").write_bytes(b"1")
    bag = [Path("bag")]
    assert [searches(holdout=bag), searches(holdout=bag)] == [1, 0]
    Path("bag", "part.mcap").write_bytes(b"12")
    assert searches(holdout=bag) == 1


def test_a_log_that_is_written_to_meanwhile_is_searched_again(workspace, searches):
    def writing(*given, **named):
        with Path("log.csv").open("a", encoding="utf-8") as file:
            file.write("\n")
        return "found"

    text = Path("log.csv").read_text(encoding="utf-8")
    asked(search=writing)
    assert searches() == 1
    Path("log.csv").write_text(text, encoding="utf-8")
    assert searches() == 1


def test_no_more_than_so_many_are_kept_and_the_least_used_go_first(workspace, monkeypatch):
    for number in range(5):
        kept_records.keep_record("ladder", str(number), number, 3)
        assert kept_records.kept_record("ladder", "0") == 0  # used again and again
    left = [number for number in range(5) if kept_records.kept_record("ladder", str(number)) is not None]
    assert len(left) == 3 and left[0] == 0


def test_at_zero_nothing_is_kept(searches, monkeypatch):
    monkeypatch.setenv(kept_searches.KEPT_VARIABLE, "0")
    assert [searches(), searches()] == [1, 1] and not list(Path("cache").iterdir())


def test_a_number_that_is_none_is_refused(searches, monkeypatch):
    monkeypatch.setenv(kept_searches.KEPT_VARIABLE, "many")
    with pytest.raises(Failure, match="must be how many searches are kept, 0 for none, not 'many'"):
        searches()


class Trap:
    """Reading it writes a file."""

    def __reduce__(self):
        return Path.touch, (Path("sprung"),)


def test_what_was_put_or_changed_there_is_not_read(workspace):
    kept_records.keep_record("ladder", "mine", "a record", 3)
    (path,) = Path("cache").iterdir()
    path.write_bytes(path.read_bytes()[:32] + pickle.dumps(Trap()))
    assert kept_records.kept_record("ladder", "mine") is None and not path.exists()
    write_sealed(path, pickle.dumps(Trap()))
    path.chmod(0o666)  # others can write it
    assert kept_records.kept_record("ladder", "mine") is None and not Path("sprung").exists()


def test_a_record_whose_module_or_effect_has_gone_counts_for_nothing(workspace, library, monkeypatch):
    kept_records.keep_record("ladder", "module", library, 3)
    assert kept_records.kept_record("ladder", "module") is library
    monkeypatch.setattr(kept_records, "cache_folder", lambda: workspace)
    assert kept_records.kept_record("ladder", "module") is None
    monkeypatch.undo()
    assert (cache_folder() / f"{library.__name__}.py").exists()


def test_what_is_no_plain_record_is_not_kept(workspace):
    kept_records.keep_record("ladder", "odd", lambda: 0, 3)
    assert not list(Path("cache").iterdir())


@pytest.mark.slow
def test_laws_effects_of_ones_own_and_plants_of_ones_own_are_taken_up_too(workspace, monkeypatch):
    diagnoses, ladders = (counted(monkeypatch, wheelpend.api, name) for name in ("diagnose", "explain"))
    Path("effects.toml").write_text(EFFECT_OF_MINE, encoding="utf-8")
    for question in (("diagnose", "log.csv", "--law", "--json", "-"), ("explain", "log.csv", "--json", "-")):
        assert run(*question).stdout == run(*question).stdout
    assert len(diagnoses) == len(ladders) == 1
    plant = ("--plant", str(ROOT / "tests" / "plants" / "lever.py"))
    run("new", "lever", *plant)
    of_lever = ("--model", "lever/model.toml", *plant)
    run("simulate", "-o", "lever.csv", "--duration", "8", *of_lever)
    assert run("explain", "lever.csv", *of_lever).stdout == run("explain", "lever.csv", *of_lever).stdout
    assert len(ladders) == 2
