"""Identification by the method of choice, each with standard errors.

In: a model and logs. Out: `Identification`. Question: which values do least squares, instrumental variables, recursion,
energy, inverse dynamics and shooting give, and how biased are they?
"""
