"""Case studies on measured logs: python -m wheelpend.benchmarks.measured [--data FOLDER] [--out docs]."""
