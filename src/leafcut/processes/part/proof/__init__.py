"""Verify a part program, with a module for each operation.

The verification does not use the plan or the planned motion.
"""
