"""Results of the library: subclasses of the model's results that can describe, show and save themselves.

The model has no reports and writes no files, so these methods are here; `api` returns these classes. Each has its own
module, so that a job loads only its own result.
"""
