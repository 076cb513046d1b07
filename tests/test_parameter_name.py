"""Names of parameters are made and read in one place."""

from derive.parameter_name import ParameterName, effect_of, full_name, short_name


def test_a_name_is_read_as_it_was_made():
    for effect, parameter in (("coulomb_drive", "torque"), ("", "X1")):
        name = full_name(effect, parameter)
        assert ParameterName.parse(name) == (effect, parameter)
        assert (effect_of(name), short_name(name)) == (effect, parameter)
    assert full_name("coulomb_drive", "torque") == "coulomb_drive.torque"
