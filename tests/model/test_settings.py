"""Entries of a model.toml are changed by name, in the place that the file has for them, or not at all."""

import tomllib

import pytest

from wheelpend.errors import Failure
from wheelpend.model.record import Model
from wheelpend.model.settings import Setting, with_settings

COMMENTED = """\
plant = "wheel_pendulum"   # a robot
effects = []

[sensors]
encoder = "absolute"  # on the shaft

[columns]
theta_p = { column = "pitch", unit = "deg" }  # of the old logger
"""


def changed(text, *settings):
    return with_settings(Model.parse(text), [Setting.parse(s) for s in settings]).text


def test_a_line_changes_and_all_others_with_their_comments_stay():
    found = changed(COMMENTED, "columns.theta_p.sign=-1", "sensors.encoder=relative")
    before, after = COMMENTED.splitlines(), found.splitlines()
    assert [line for line in after if line not in before] == [
        'encoder = "relative"  # on the shaft',
        'theta_p = { column = "pitch", unit = "deg", sign = -1 }  # of the old logger',
    ]
    assert len(after) == len(before)


@pytest.mark.parametrize(("setting", "path", "value"), [
    ("columns.dtheta_p.unit=deg/s", "columns.dtheta_p", {"column": "dtheta_p", "unit": "deg/s"}),
    ("columns.theta_w.column=enc", "columns.theta_w", {"column": "enc"}),
    ('columns.v_in={ column = "u", scale = 2 }', "columns.v_in", {"column": "u", "scale": 2}),
    ("sensors.noise.theta_p=0.01", "sensors.noise", {"theta_p": 0.01}),
    ("constants.g=9.8", "constants", {"g": 9.8}),
    ("parameters.X1.nominal=0.04", "parameters.X1", {"nominal": 0.04}),
    ("controller.kind=pid", "controller", None),
    ("assumptions.planar=false", "assumptions", {"planar": False}),
])  # fmt: skip
def test_a_section_or_an_entry_that_is_not_there_is_made(setting, path, value):
    if value is None:
        with pytest.raises(Failure, match="gains"):  # a controller without gains is none
            changed(COMMENTED, setting)
        assert '[controller]\nkind = "pid"' in changed(COMMENTED, setting, "controller.gains=[1.0, 2.0, 3.0]")
        return
    found = tomllib.loads(changed(COMMENTED, setting))
    for key in path.split("."):
        found = found[key]
    assert found == value


def test_an_entry_is_taken_away_by_an_empty_value():
    assert "unit" not in changed(COMMENTED, "columns.theta_p.unit=")
    gone = changed(COMMENTED, "columns.theta_p=")
    assert "theta_p" not in gone and "[columns]" in gone
    with pytest.raises(Failure, match=r"no columns\.theta_w"):
        changed(COMMENTED, "columns.theta_w=")
    noisy = changed(COMMENTED, "sensors.noise.theta_p=0.01", "sensors.noise.dtheta_p=0.1")
    assert tomllib.loads(changed(noisy, "sensors.noise="))["sensors"] == {"encoder": "absolute"}


@pytest.mark.parametrize(("setting", "words"), [
    ("theta_p", "must be KEY=VALUE"),
    ("columns..a=1", "must be KEY=VALUE"),
    ("=1", "must be KEY=VALUE"),
    ("columns=1", "must be in one of the sections"),
    ("colums.theta_p.unit=deg", "Did you mean 'columns'"),
    ("effects=coulomb_drive", "wheelpend add EFFECT"),
    ("effect.coulomb_drive.torque=1", "identify LOG --save"),
    ("plant=slide", "wheelpend new DIR"),
    ("columns.theta_p.unit=furlong", "No unit named 'furlong'|furlong"),
    ("columns.theta_p.column.a=1", "must be a table"),
    ("sensors.encoder=upside", "'absolute' or 'relative'"),
    ("constants.g=nan", "g"),
    ("columns.theta_p.column=", "column"),
])  # fmt: skip
def test_what_is_no_setting_is_refused_in_words(setting, words):
    with pytest.raises(Failure, match=words):
        changed(COMMENTED, setting)


def test_several_settings_are_made_together_or_none():
    with pytest.raises(Failure):
        changed(COMMENTED, "sensors.encoder=relative", "columns.theta_p.sign=3")
    both = tomllib.loads(changed(COMMENTED, "constants.R=0.2", "constants.g=9.81"))
    assert both["constants"] == {"R": 0.2, "g": 9.81}
