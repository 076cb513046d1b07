"""A command that is interrupted at any moment leaves whole files, old ones or new ones."""

import os

import pytest

from tests.support import run, simulated
from wheelpend import Model, save_log
from wheelpend.model import workspace as folders
from wheelpend.model.user_effects import write_user_effects
from wheelpend.simulation.references import save_trajectory

ENTRY = {"change": "add slope"}


def contents(folder):
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


class Interruptions:
    """Lets so many files take their place, and interrupts before the next."""

    def __init__(self, monkeypatch, allowed):
        self.allowed, self.replaced, self.replace = allowed, [], os.replace
        monkeypatch.setattr("os.replace", self)

    def __call__(self, source, target):
        if len(self.replaced) == self.allowed:
            raise KeyboardInterrupt
        self.replaced.append(os.path.basename(target))
        self.replace(source, target)


@pytest.fixture(scope="module")
def old_and_new(tmp_path_factory):
    """The files of a workspace before and after an effect is added."""
    folder = tmp_path_factory.mktemp("workspace")
    model = folders.create(folder)
    before = contents(folder)
    folders.save(model.with_effects(["slope"]), ENTRY)
    return before, contents(folder)


def test_a_change_that_is_interrupted_leaves_each_file_old_or_new_and_nothing_beside_them(
    old_and_new, tmp_path, monkeypatch
):
    old, new = old_and_new
    changed = [n for n in new if old.get(n) != new[n]]
    for allowed in range(len(new) + 1):
        folder = tmp_path / str(allowed)
        for name, data in old.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(data)
        with monkeypatch.context() as patch:
            every = Interruptions(patch, allowed)
            try:
                folders.save(Model.open(folder).with_effects(["slope"]), ENTRY)
            except KeyboardInterrupt:
                assert len(every.replaced) == allowed
        found = contents(folder)
        assert set(found) <= set(new)
        for name, data in found.items():
            assert data == (new if os.path.basename(name) in every.replaced else old)[name]
        if found == new:
            break
    assert found == new and {"model.toml", "history.json"} < set(map(os.path.basename, changed)) <= set(every.replaced)
    assert every.replaced[-2:] == ["model.toml", "history.json"]  # what was interrupted is not in the history


@pytest.mark.parametrize("name", ["log.csv", "log.parquet", "command.csv", "effects.toml", "model.toml"])
def test_a_file_that_is_written_takes_its_place_when_it_is_whole(name, tmp_path, monkeypatch):
    def write():
        path = tmp_path / name
        if name == "effects.toml":
            table = {"family": "drive", "sentence": "", "on": "drive", "law": "c*speed^3", "parameters": {
                "c": {"unit": "V", "typical": 0.1}}}  # fmt: skip
            write_user_effects(tmp_path, {"own_drag": table}, Model.default().plant_signature)
        elif name == "model.toml":
            Model.default().save(path)
        elif name == "command.csv":
            save_trajectory(path, *(simulated(duration=1.0).t for _ in range(3)))
        else:
            save_log(path, simulated(duration=1.0))

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        Interruptions(patch, 0)
        write()
    assert list(tmp_path.iterdir()) == []
    write()
    assert [p.name for p in tmp_path.iterdir()] == [name]


def test_a_command_says_nothing_of_a_change_that_did_not_happen(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run("new")
    with monkeypatch.context() as patch:
        Interruptions(patch, 0)
        with pytest.raises(BaseException):  # noqa: B017
            run("add", "slope")
    assert Model.open().effects == () and folders.history(tmp_path) == []
