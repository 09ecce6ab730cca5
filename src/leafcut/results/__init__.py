"""The results of the library: those of the model that also describe, show and save themselves.

The model knows no report and writes no file, so the methods are in these subclasses; `api` returns them. Each has a
module, so that a job loads its own result only.
"""
