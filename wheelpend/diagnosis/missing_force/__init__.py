"""The generalised force that a model lacks, and laws for it.

In: a fit and its segments. Out: the force over time and over the states, how much of it repeats, a free-form law.
Question: where does the model fail, and on what does that depend?
"""
