"""Diagnosis: which physical effect is missing in a model.

In: an estimation problem. Out: `Diagnosis` with ranked candidates and their evidence, `Explanation` with the error
ladder, `Comparison`. Question: what is missing, how sure is that, and how much does adding it help?
"""
