"""Diagnosis: which physical effect is missing in a model.

In: an estimation problem. Out: `Diagnosis` with ranked candidates and their evidence, `Ladder` with the error
ladder, `Comparison`. Question: what is missing, how sure is that, and how much does adding it help?

- `criteria`: thresholds that several modules share.
- `score_test`: the expected gain of every effect, from one linearisation.
- `equation_scores`: effects by what a regression with the plant's parameters leaves of the equations.
- `pair_search`: the pair of effects that leaves least together.
- `events`: effects that happen once, and when.
- `backlash_start`: a start for backlash, whose contacts make and break.
- `refit`: refits of the model with one effect more.
- `physical`: whether an effect's parameters are possible.
- `evidence`: Wald and encompassing tests, agreement of blocks, validation error.
- `ranking`: the order of the refitted effects.
- `candidates`: which effects are refitted, how far, and which are validated.
- `missing_force`: the generalised force that the model lacks, and laws for it.
- `block_evidence`: how much likelier data are with an effect, in blocks, and whether more than noise is left.
- `structures`: probabilities of nothing, of each effect, of several together, and of none of these.
- `negligible`: effects that are certain and too small to matter.
- `verdict`: the candidates that are named, and their equivalents.
- `alternatives`: an event, or backlash, in place of a lasting effect.
- `outside_force`: short times in which something else moves the machine, and the logs without them.
- `rounds`: one round of score test, refits and verdict.
- `stepwise`: rounds one after the other, forward and backward; `diagnose`.
- `explain`: the error ladder.
- `change`: one effect added or removed.
- `horizons`: the prediction error over the horizon.
- `replay`: the closed loop replayed with the model.
- `compare`: a model as it stands against measurements.
- `model_errors`: several models on the same logs.
- `predict`: what it predicts of a log, sample by sample.
"""
