"""Verification of a cutting program: the effect of the program on the sheet, compared with the drawing."""
