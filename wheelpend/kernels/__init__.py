"""Compiled kernels of a model.

In: plant, assumptions and effects. Out: a generated module, derived and compiled once per machine and kept. Question:
where is the machine code that simulates and linearises this model?
"""
