"""Simulation: measurement files of a machine under its controller.

In: a model with values, a reference trajectory, effects to hide. Out: a `Log` with sensor noise. Question: what would
the sensors read?
"""
