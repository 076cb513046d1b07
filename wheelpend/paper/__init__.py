"""The paper of Peng, Cheng and Tsai (Electronics 2023, 12, 4569), checked equation by equation.

In: the 43 numbered equations and every table, typed as printed. Out: a Verification with one or more findings per
equation and number, as text and as docs/paper.md. Question: what does the paper print that the derivation from
geometry, virtual work and Laplace algebra does not give?

letters              the paper's letters as symbols
notation             expressions as one line of text
equations            the equations as printed
numbers              the numbers as printed
combination          coefficients of a linear combination
filtering            the filtered regression by Laplace algebra
derivation           the equations as derived
differences          equality of two expressions, and the kind of their difference
residuals            printed equations put together, and what is left over
relations            the relations that must hold between them
assumptions          choices of the derivation made otherwise
printed_numbers      a number with its rounding, and the result of its check
percentages          errors in the tables against the estimates beside them
simulation_settings  settings that a simulation needs and the paper does not state
parameters           constants against the reference parameters
findings             findings on the equations
verification         all equations against the derivation
verification_text    the findings on the terminal
page                 the findings as docs/paper.md
"""
