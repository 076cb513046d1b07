"""Measurement logs: from files as people have them to one record of sampled channels.

In: CSV, Parquet, MATLAB files and bags, with the columns that a plant has. Out: `Log`, in SI units and continuous, and
the noise of its channels. Question: what was measured, when, and how well?
"""
