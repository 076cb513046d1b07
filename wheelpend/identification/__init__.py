"""Identification by the method of choice, each with standard errors.

In: a model and logs. Out: `Identification`. Question: which values do least squares, instrumental variables, recursion,
energy, inverse dynamics, shooting and the filter-error method give, and how biased are they?

    identify            the public function and its result
    method_options      the methods' names and settings, checked
    given_restrictions  fixed values and bounds that a user gives, checked
    filter_error_method maximum likelihood with random forces, the default
    widening            of intervals by the correlation time that is assumed of a force
    remainder           what a model leaves to chance, and model.toml with it
    remainder_at        the same at given values, or refitted from them, for results that judge a model
    remainder_warnings  a bound, an inertia that cannot be, a force as large as the drive
    residual_tests      are the filter's innovations white, and independent of past inputs?
    regression          a log's regression by each method
    energy              least squares on the energy balance
    bandwidth           the cut-off that noise in the accelerations allows, `measured_motion` behind it
    inverse_dynamics    least squares on the measured motion (robotics), the force error, bursts
    instrumental        instrumental variables from the simulated closed loop
    recursive           recursive least squares
    bootstrap           parametric bootstrap: replicas of a log from a consistent estimate
    bias_test           test of least squares for bias (Durbin, Wu, Hausman)
    time_constants      the filters' time constants with the least error on replicas
"""
