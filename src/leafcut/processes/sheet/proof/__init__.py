"""Verification of a cutting program. It compares the effect of the program on the sheet with the drawing."""
