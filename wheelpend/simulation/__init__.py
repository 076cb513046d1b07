"""Simulation: measurement files of a machine under its controller.

In: a model with values, a reference trajectory, effects to hide. Out: a `Log` with sensor noise, a state space.
Question: what would the sensors read?

    simulate        a machine with hidden effects along a command, as a log
    closed_loop     the one place that plays a closed loop: controller, reference, noise and quantisation
    own_controller  the same with a Python function, called once per sample
    hidden          values of hidden effects, checked, and those of the machine they are put into
    linearize       the model linearised at rest, as a state space
    references      reference trajectories of what is controlled: built-in ones and files
"""
