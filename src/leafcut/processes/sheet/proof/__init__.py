"""Verification of a cutting program: the effect of its text on the sheet, compared with the drawing."""
