"""Verification of a part program, with a module for each operation. It uses neither the plan nor the planned motion."""
