"""Inspection of a log before any physics is blamed.

In: a log, and a model for its equations. Out: `Inspection` with findings and the lines of a model.toml that cure them.
Question: is something wrong with clock, units, signs, wiring or sensors?
"""
