"""Units in the names of columns, as loggers, phones and people write them."""

import pytest

from wheelpend.logs.units import contradicts, plain_unit, stated_unit, unknown_unit, without_unit, words_of

STATED = {
    "angle (°)": "deg", "Winkel [°]": "deg", "Angle (degree)": "deg", "angle (degrés)": "deg", "Winkel [Grad]": "deg",
    "rate (°/s)": "deg/s", "speed (deg/sec)": "deg/s", "speed_deg_per_sec": "deg/s", "gyro_dps": "deg/s",
    "speed (rev/min)": "rpm", "Speed (RPM)": "rpm", "speed_rps": "rev/s", "Gyroscope x (rad/s)": "rad/s",
    "way (meters)": "m", "way [µm]": "um", "v (m/sec)": "m/s", "x_mm": "mm", "stamp [µs]": "us", "t_ms": "ms",
    "torque [N·m]": "N m", "torque_Nm": "N m", "torque (Ncm)": "N cm", "force (mN)": "mN", "u_mV": "mV", "i_A": "A",
}  # fmt: skip
NONE = ("u_a", "x_n", "theta_m", "tau_m", "omega_m", "V_m", "v_m", "i_m", "torque (kgf cm)", "angle (raw)", "x (left)",
        "q", "position")  # fmt: skip


@pytest.mark.parametrize("name", STATED)
def test_a_unit_is_known_by_its_usual_spellings(name):
    assert stated_unit(name) == STATED[name]


@pytest.mark.parametrize("name", NONE)
def test_letters_that_words_contradict_and_units_without_a_conversion_state_nothing(name):
    assert stated_unit(name) == ""


def test_a_letter_that_no_word_contradicts_is_a_unit():
    assert [stated_unit(n) for n in ("x_m", "t_s", "force_N", "volt_V")] == ["m", "s", "N", "V"]
    assert contradicts("m", "tau_m") and not contradicts("m", "way_m")


@pytest.mark.parametrize(("name", "unit"), [("torque (kgf cm)", "kgf cm"), ("force [lbf]", "lbf"), ("w (mph)", "mph")])
def test_a_unit_without_a_conversion_is_told_as_one(name, unit):
    assert unknown_unit(name) == unit


@pytest.mark.parametrize("name", ["x (left)", "angle (raw)", "angle (deg)", "wheel (1)", "x"])
def test_what_is_no_unit_and_what_is_known_is_none_without_a_conversion(name):
    assert unknown_unit(name) == ""


def test_a_row_of_units_has_the_same_spellings():
    assert [plain_unit(c) for c in ("[°]", "degrees/second", "N.m", "(rpm)", "-", "1")] == [
        "deg", "deg/s", "N m", "rpm", "", ""]  # fmt: skip


def test_words_of_a_name_have_no_accents():
    assert words_of("ángulo_Motor2") == ["angulo", "motor"]


@pytest.mark.parametrize(
    ("name", "unit", "rest"),
    [
        ("Angle in deg", "deg", "Angle"), ("wheel speed rad/s", "rad/s", "wheel speed"),
        ("Spannung in V", "V", "Spannung"),
        ("theta rad", "rad", "theta"), ("Phase A", "", "Phase A"), ("plug in", "", "plug in"), ("u_mV", "mV", "u"),
        ("Torque [N m]", "N m", "Torque"), ("Torque in N m", "N m", "Torque"), ("torque_N m", "N m", "torque"),
        ("Counts per rev", "", "Counts per rev"), ("Filter MA", "", "Filter MA"), ("Motor Rev", "", "Motor Rev"),
    ],
)  # fmt: skip
def test_a_unit_after_in_or_after_a_space_is_stated_and_a_letter_after_a_space_is_none(name, unit, rest):
    assert (stated_unit(name), without_unit(name)) == (unit, rest)
