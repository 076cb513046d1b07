"""Results as text, a file per result; the terminal and the page print the same functions' answers.

In: results of every room above. Out: sentences, and lines and tables in reading order. Question: how is it said?

table             a table of strings
effect_sizes      coefficients of effects with standard errors, as torques and as shares of the drive voltage
title             the finding as the title of a page
verdict           verdict and headline of a diagnosis or an explanation; evidence; equivalents
force_ranges      ranges of the states in which the missing force is concentrated
effects, history  the library, and the changes of a workspace
settings          entries of the model file before and after
split             the two files of a log
structures        probabilities of what is missing
remainder         what is left to chance, and the intervals that it widens
unexplained       repeatability of the missing force, and a free-form law for it
comparison, diagnosis, explanation, identification, residuals, inspection, first_look, design, campaign, export    whole
                  results for the terminal
"""
