"""Campaigns: the same analysis of many logs, on all cores.

In: a model, and logs or seeds of simulated ones. Out: a result per log, a summary, a CSV table. Question: do the logs
agree, and does the method recover what was simulated?

one_log            the result of one log
runner             all of them
cluster            on Dask: this machine's cores, or those of a scheduler
journal            results of a resumable run in a file as they come
result_set         results of a question in a Parquet data set: which logs are known; result_rows its rows
summary            bias, spread and coverage over simulated logs, agreement of measured ones
addresses          logs behind s3:// and https://
manifest           which logs are of which unit, of which day
units              what the results say of units; units_text the same for people
misfits            units that the model describes worse than the others
fleet              what units have in common, and which stand out by what
fleet_page         the fleet as one HTML page; fleet_figures its pictures
drift              what changes with the date
table              one line per log, for other programs
text               the same for people
"""
