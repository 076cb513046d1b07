"""Measurement logs: from files as people have them to one record of sampled channels.

In: CSV, Parquet, MATLAB files, bags, DataFrames and arrays, with the columns that a plant has. Out: `Log`, in SI units
and continuous, and the noise of its channels. Question: what was measured, when, and how well?

- log: the record `Log`, its gapless ranges and segments
- columns: the columns that a plant needs, and how a file's columns are mapped onto them
- units: those that are known, how files spell them, and which one a column's name states
- read: files, frames and arrays to logs, and logs to files
- sources: what a log is taken from, and tables in memory
- guess: column maps guessed from names, units and clock
- commands: an input without values for a while, or logged only when it changes
- checks: errors and warnings of a log that was read
- same_record: rows that two logs have in common
- recording: a log without what is no measurement, by `faults` (saturated sensors, joined recordings, one held or on the
  floor), which are `finding`s
- runs: the stretches of samples in which something holds
- rest: from where on a machine stands still until its log ends, and logs that begin with a step from rest
- unlogged_drive: a machine that moves as nothing free does though its log has no drive
- shipped: the logs that come with the package
- summed_speed: the way that a speed comes to; smoothed_input: an input that a sensor reads, without its noise
- unwrap: wrapped angles and reset counters, made continuous
- noise: standard deviation and quantisation of every channel
- white_noise: from differences and predictions, whichever leaves less
- coloured_noise: of channels that were filtered or fused before they were logged
- outliers: spikes, which become missing values, and jumps, which split a log
- tables: files as named columns of numbers, by what is in them
- csv_text: encoding, separator, comments, names and units of a text table; legend: names from numbered comments
- polars_files: CSV and Parquet files through Polars
- bags: ROS 2 bags and MCAP files, resampled onto one clock
"""
