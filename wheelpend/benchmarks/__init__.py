"""How good and how fast the tool is: about the tool itself, not part of it.

In: simulated, engine-made and measured logs. Out: pages of docs/. Question: how often is the diagnosis right, how fast
is it, and what does it say on measured machines?
"""
