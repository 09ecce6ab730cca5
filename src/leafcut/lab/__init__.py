"""Experiments: algorithms repeated with several seeds on one map, what each run found, and how they compare."""
