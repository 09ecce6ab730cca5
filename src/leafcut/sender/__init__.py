"""Sends programs to GRBL and Marlin boards line by line, after checking every line, and stops the machine safely."""
