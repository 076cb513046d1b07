"""Accuracy and speed of the tool itself, measured from a clone; the wheel leaves this package out.

In: simulated, engine-made and measured logs, and the code. Out: pages of docs/. Question: how often is the diagnosis
right, how fast is it, and does it agree with what is published about measured machines?

hidden_effects  hit rate of the diagnosis on logs with hidden effects
random_force    precision, intervals and random forces of the filter-error method
benches         all that is missing named, on machines that no code of the tool simulates
probabilities   whether the probabilities of a diagnosis mean what they say
fleets          whether a campaign finds the units of a fleet that aged
speed           times beside peers, and growth of time and memory
measured        case studies on measured logs
demo_force      the missing force of the demo log beside the true one
structure       rooms, imports and lengths of the code
code_state      hash of the code that results depend on
recording       answers of a study on all cores, each written down as it comes
markdown        tables and marked places that they share
"""
