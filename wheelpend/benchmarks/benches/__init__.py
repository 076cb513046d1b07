"""Machines on benches, simulated apart from the tool: how often all that is missing is named, with its size.

In: swings, motors, driven pendulums and balancing robots drawn at random, in steps of 4 or 20 µs, on an encoder or
with noise. Out: docs/benches.md. Question: is the diagnosis right where no code of the tool made the log?

machines     the motion of a link or shaft, with dry friction that may hold
robots       the motion of a robot that balances by a loop of its own
cases        what is drawn: machine, command, sensor and effects
robot_cases  what is drawn of a robot
trial        one log: explained, and the truth beside it
runner       all cases, each outcome written down as it comes
page         counts in Markdown
"""
