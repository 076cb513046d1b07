"""Experiments computed in advance: which log to record next.

In: a diagnosis that is ambiguous, logs, or a model as it stands. Out: advice in sentences, or `Design` with the most
informative command. Question: which experiment would distinguish the effects, or sharpen the parameters?

- `excitation`: reference trajectories of what is controlled.
- `simulated_experiment`: such an experiment simulated, made smaller until it keeps the limits; gains that balance.
- `information`: the information of logs, added up, and separations and standard errors from it.
- `question`: effects to be distinguished, or parameters, and the information of the logs at hand.
- `reversals`: the sign of every effect once a part is turned round.
- `recommendation`: commands, reversals and sensors, rated by separation.
- `advice`: the recommendation in sentences.
- `design_start`: model, values and sensors from which a design starts.
- `pose`: the question of a design.
- `search`: the best trajectory within limits.
- `design`: all of it, for `wheelpend design`.
"""
