"""The kernels of a model as strings, each file with the record of what the templates need beside them.

``arguments`` says where a kernel finds its symbols, ``motion`` turns the equations of motion into accelerations and
their derivatives, ``friction`` dry friction and hysteresis, ``sensors`` the readings, ``regression`` the
regressor and what its filters take; ``parameters`` is the table of the model's numbers.
"""
