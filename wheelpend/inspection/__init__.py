"""Inspection of a log before any physics is blamed.

In: a log, and a model for its equations. Out: `Inspection` with findings and the lines of a model.toml that cure them.
Question: is something wrong with clock, units, signs, wiring or sensors?

- inspect: the record `Inspection`, of a log, of a log under a model, of a file
- findings: `Finding`, and the corrections that cure a log
- signals: a log on a uniform grid, smoothed derivatives, and scans over time shifts
- kinematics: faults that show without a model: wrapped angles, swapped columns, degrees, gyro against pitch
- wiring: faults that only the equations of motion show: signs, encoder
- clocks: delays between input, encoder, pitch and gyro
- standstill: gaps, constant signals and standstills
"""
