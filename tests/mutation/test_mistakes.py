"""Every mistake of the list can be made: what it replaces stands where it says, once."""

from tests.mutation.run import read_mistakes


def test_every_mistake_of_the_list_can_be_made():
    assert len(read_mistakes()) >= 120
