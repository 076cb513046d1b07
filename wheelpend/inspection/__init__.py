"""Inspection of a log before any physics is blamed.

In: a log, and a model for its equations. Out: `Inspection` with findings and the lines of a model.toml that cure them.
Question: is something wrong with clock, units, signs, wiring or sensors?

- inspect: the record `Inspection`, of a log, of a log under a model, of a file
- split: a stretch of a log held out, as files of their own
- first_look: a log where there is no model: `survey` says what its columns are by their `column_roles`, which is its
  time by `own_clock`, and where a rate comes from by `rate_origin`; `plant_fit` which plants have them,
  `gravity` where an angle hangs, `angle_unit` whether it is in degrees, `guesses` of units that no name states,
  `camera_path` two that are one angle, `proposal` writes the model.toml
- file_values: the numbers of a file's columns without a model; column_names: what their names state;
  unnamed_columns: commands and batteries whose names say nothing; counters: those that only count rows, tell the time
  once more, or are another one times a factor
- findings: `Finding`, and the corrections that cure a log
- signals: a log on a uniform grid, smoothed derivatives, and scans over time shifts
- kinematics: faults that show without a model: wrapped angles, swapped columns, degrees, a rate against its angle
- mounting: a body whose angle sensor is turned over
- wiring: all faults, by the check that the plant brings along or by those for any machine
- equations: faults that the equations of motion show on any machine with one input: signs, input at another time;
  first_motion: which way one with one place sets out from rest
- wheels_and_body: the same of a body on wheels, with its IMU; `encoder` what its encoder reads, and in which unit;
  `voltage` its equations with unknown parameters, `fused_pitch` a pitch that takes the robot's acceleration for tilt
- sampling: rows dropped or timed anew, clocks that jitter; raw_units: a duty instead of a voltage, a command
  without its direction; noisy_input: an input that a sensor reads, whose noise does not act; late_command: one that
  is logged a row after it acts
- clocks: findings on delays between input and sensors
- standstill: gaps, constant signals and standstills
"""
