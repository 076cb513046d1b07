"""Names of columns from comments that begin with the columns' numbers."""

import pytest

from wheelpend.logs.csv_text import csv_layout
from wheelpend.logs.legend import names_of_legend

ROBOT = """%% logfile from robot 5
%  1    time 0.012 sec
%  2    mission (2) state 2
%  3  4 Acc x,y [m/s2]: -4.986719 -1.440874
%  5  6 Motor voltage [V] left, right: 8.0 8.0
%  7  8 Pose h,tilt [rad,m]: 0.005182 0.509450
%  9 10 Get data time [us]: 500 +ctrl 810
% 11 12 Balance pitch ref -0.021709 [rad], vel ref [m/s] 0.0
% interval = 30
"""
NAMES = [
    "time [sec]", "mission (2) state 2", "Acc x [m/s2]", "Acc y [m/s2]", "Motor voltage left [V]",
    "Motor voltage right [V]",
    "Pose h [rad]", "Pose tilt [m]", "Get data time 1 [us]", "Get data time 2 [us]", "Balance pitch ref [rad]",
    "vel ref [m/s]",
]  # fmt: skip


def test_columns_that_a_comment_lists_go_before_remarks_that_are_numbered(tmp_path):
    head = "# Columns: t x\n# 1. t was read late\n# 2. camera at 2 m\n"
    (tmp_path / "two.log").write_text(head + "".join(f"{k / 10} {k}\n" for k in range(30)))
    assert csv_layout(tmp_path / "two.log").names == ["t", "x"]


def test_a_file_whose_comments_number_its_columns_has_their_names_and_units(tmp_path):
    rows = "".join(" ".join(f"{k / 10 + c}" for c in range(len(NAMES))) + "\n" for k in range(30))
    (tmp_path / "robot.log").write_text(ROBOT + rows)
    assert csv_layout(tmp_path / "robot.log").names == NAMES


@pytest.mark.parametrize(("comments", "names"), [
    (["column 1: time [s]", "column 2: angle (deg)"], ["time [s]", "angle (deg)"]),
    (["1 March 2024", "1 time [s]", "2 joint 2 angle [rad]"], ["time [s]", "joint 2 angle [rad]"]),
    (["1. released by hand", "2. camera at 2 m"], []),
    (["1 kHz log of the motor", "2 links"], []),
    ([f"{'9' * 5000} t"], []),
    (["Col 1 = t", "a word between", "Col 2 = duty"], ["t", "duty"]),
    (["1. t", "3. duty"], []),  # what the second is is not said
    (["1. time", "2. time"], []),  # one of both is called otherwise
    (["1. t", "2. duty", "3. speed"], []),  # of another file
    (["2021-01-05 10:00", "12 runs of the motor"], []),
])  # fmt: skip
def test_comments_that_do_not_number_all_columns_name_none(comments, names):
    assert names_of_legend(comments, 2) == names
