"""The study of an exported compensator and identifier goes on where it was, and counts what it found."""

import pytest

from wheelpend.benchmarks.in_the_loop.compensate import FRICTION_SIZES_V, PITCH_COMMANDS, Pitch
from wheelpend.benchmarks.in_the_loop.compensate import Answer as DrawAnswer
from wheelpend.benchmarks.in_the_loop.learn import Answer as RecordAnswer
from wheelpend.benchmarks.in_the_loop.learn import Learnt
from wheelpend.benchmarks.in_the_loop.page import STUDY_MARKS, section_text, study_texts, write
from wheelpend.benchmarks.in_the_loop.runner import plan, run
from wheelpend.errors import Failure


def made_up(key):
    """An answer: compensation leaves a tenth or a fifth of friction's part; what is learnt is off by two bounds."""
    study, seed = key.split()
    if study == "learn":
        off = 2e-3 if int(seed) % 2 else -2e-3
        return RecordAnswer(key, parameters={"X1": Learnt(1.2, 1.0 + off, 4e-3, 1.0, 1e-3, 1.0)})
    left = 0.1 * int(seed)
    pairs = [(size, command) for size in FRICTION_SIZES_V for command in PITCH_COMMANDS]
    return DrawAnswer(key, pitches=tuple(Pitch(*pair, 1e-3, left * 1e-3, 1e-4, 2e-4, 1.1e-4) for pair in pairs))


def quiet(line):
    pass


def test_a_run_goes_on_where_it_was_interrupted(tmp_path):
    tried = []

    def attempt(key):
        tried.append(key)
        return made_up(key)

    for seeds in (1, 2, 2):
        found = run(tmp_path, plan(seeds=seeds), attempt=attempt, jobs=1, progress=quiet)
    assert sorted(tried) == sorted(found) == sorted(plan(seeds=2))


def test_the_page_counts_draws_and_records_and_keeps_the_study_that_was_not_asked_for(tmp_path):
    run(tmp_path, plan(["compensate"], 2), attempt=made_up, jobs=1, progress=quiet)
    answers = run(tmp_path, plan(["learn"], 4), attempt=made_up, jobs=1, progress=quiet)
    text = section_text(answers)
    assert "2 draws from the covariance" in text and "4 records of 20 s" in text
    assert "| 0.3 | standing | 15 % | 20 % | 2.00 | 1.10 |" in text
    assert "| X1 | 20 % | 0.2 % | 2 | 0.50 |" in text
    page = tmp_path / "export_c.md"
    places = "\n".join(f"{begin}\nold\n{end}" for begin, end in STUDY_MARKS.values())
    page.write_text(f"before\n{places}\nafter\n", encoding="utf-8")
    write(page, answers)
    written = page.read_text(encoding="utf-8")
    assert all(part in written for part in study_texts(answers).values())
    assert "old" not in written and written.startswith("before") and written.endswith("after\n")
    assert (tmp_path / "friction_compensated.svg").stat().st_size > 1000
    page.write_text("no marks", encoding="utf-8")
    with pytest.raises(Failure, match="must have the lines"):
        write(page, answers)


def test_writing_one_study_leaves_the_table_of_the_other_as_it_is(tmp_path):
    page = tmp_path / "export_c.md"
    page.write_text("".join(f"{a}\nold {name}\n{b}\n" for name, (a, b) in STUDY_MARKS.items()), encoding="utf-8")
    write(page, run(tmp_path, plan(["learn"], 2), attempt=made_up, jobs=1, progress=quiet))
    written = page.read_text(encoding="utf-8")
    assert "old compensate" in written and "old learn" not in written and "2 records" in written
    assert not (tmp_path / "friction_compensated.svg").exists()


def test_what_could_not_be_used_is_said_and_not_counted(tmp_path):
    def attempt(key):
        return RecordAnswer(key, "it fell") if key.endswith("2") else made_up(key)

    text = section_text(run(tmp_path, plan(["learn"], 3), attempt=attempt, jobs=1, progress=quiet))
    assert "2 records" in text and text.endswith("- learn 2: it fell")
