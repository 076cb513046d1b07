"""Parameter estimation: the maximum-likelihood fit of a model to logs by multiple shooting.

In: a model and its logs. Out: `Fit`, with covariances, and the error on validation data. Question: which parameter
values make the measurements likeliest, and how well do they predict what the fit has not seen?
"""
