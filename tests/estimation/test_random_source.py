"""Random sources that a search begins with."""

from wheelpend.estimation.random_source import RandomSource, with_forces

FORCE = RandomSource("wheel", (1.0, 0.0), (0.0, 0.0), 2.0, 0.5)
ERROR = RandomSource("theta_w", (0.0, 0.0), (1.0, 0.0), 3.0, 0.5)


def test_forces_of_all_logs_are_made_smaller_and_faster_and_errors_stay():
    ((force, error), (other,)) = with_forces(((FORCE, ERROR), (FORCE,)), 0.5, 0.5, 0.01)
    assert (force.rms, force.correlation_time, error) == (1.0, 0.25, ERROR) and other == force


def test_no_force_is_larger_than_the_largest_and_an_error_may_be():
    ((force, error),) = with_forces(((FORCE, ERROR),), 0.75, 1.0, 0.01, 1.25)
    assert (force.rms, error) == (1.25, ERROR)
    ((small,),) = with_forces(((FORCE,),), 0.5, 1.0, 0.01, 1.25)
    assert small.rms == 1.0
