"""The search for a missing effect where sensor noise will never be reached: by likelihood, a random force in it.

In: a problem and a start. Out: diagnoses, each with the first candidate of the one before in its model.
Question: what is left that repeats, on a machine that feels more than any library holds?

- `search`: effects added one by one, and taken out where others make them needless.
- `one_round`: which effect, or pair, a model gets next, and what is said where none is.
- `relief`: a model refitted with every effect that leads, and the way out of a minimum to which refits may lead.
- `filtered_model`: a model with the parameters and random forces that make its logs likeliest.
- `whitened_scores`: effects scored behind that filter, and behind ones that leave less to chance.
- `refits`: the model with one effect more, or less, the random force free.
- `held_out`: how likely data are that no fit has seen, in blocks.
- `judgement`: the evidence for an effect, and the order of several.
- `meaning`: whether effects mean what they are called, as they were fitted.
- `pairs`: two effects of which neither is worth a step alone.
- `filter_response`: what a known force would change in the innovations.
- `repeatability`: whether what is left to chance is a smooth function of known signals.
- `resonance`: whether what the filter misses rings at a frequency of its own.
- `slow_sources`: whether what is left to chance is slower than chance may be.
- `remaining`: what is left to chance with all of that, and laws that data follow with sizes that nothing has.
"""
