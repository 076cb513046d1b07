"""Identification by the method of choice, each with standard errors.

In: a model and logs. Out: `Identification`. Question: which values do least squares, instrumental variables, recursion,
energy, inverse dynamics and shooting give, and how biased are they?

    identify            the public function and its result
    method_options      the methods' names and settings, checked
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
