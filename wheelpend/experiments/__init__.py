"""Experiments computed in advance, and the command that tells most.

1. `question`: what is to be found out, and what the logs at hand say of it.
2. `excitation`: reference trajectories that may tell it.
3. `loop`: such an experiment played in closed loop, within limits.
4. `information`: what its log would tell beside the logs at hand.
5. `turned`: what turning a part round does to every effect.
6. `search`: the best trajectory within limits.
7. `command`: all of it, for `wheelpend design`.
"""
