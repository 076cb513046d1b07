"""Kernels generated from model.toml by `wheelpend generate`."""
