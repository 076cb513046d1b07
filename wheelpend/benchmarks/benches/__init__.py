"""Machines on benches, simulated apart from the tool: how often all that is missing is named, with its size.

In: swings, motors and driven pendulums drawn at random, in steps of 4 µs, on an encoder or with noise. Out:
docs/benches.md. Question: is the diagnosis right where no code of the tool made the log?

machines  the motion, with dry friction that may hold
cases     what is drawn: machine, command, sensor and effects
trial     one log: explained, and the truth beside it
runner    all cases, each outcome written down as it comes
page      counts in Markdown
"""
