"""The generalised force that a model lacks, and laws for it.

In: a fit and its segments. Out: the force over time and over the states, its repeatable share, a free-form law.
Question: where does the model fail, and on what does that depend?

- `smoothed_force`: the force on each row at every sample of every log, with its band, by a smoother.
- `estimate`: the record of such a force, where it is concentrated, and the force as constant in pieces of segments.
- `piecewise_force`: normal equations in parameters and in a piecewise constant force, folded for cross-validation.
- `smooth_basis`: basis functions of states, input and time.
- `repeatability`: the share of the force that such functions predict on data that did not make them.
- `law_terms`: the library of physically dimensioned terms of a law.
- `regressors`: the numbers of a term along a motion.
- `term_selection`: forward selection of terms on the linearised problem.
- `law_search`: refits with the chosen terms, and the law that lowers the validation error.
- `law_effects`: a law's terms as effects of one's own.
- `free_law`: accepting a law as an effect of the user's own.
"""
