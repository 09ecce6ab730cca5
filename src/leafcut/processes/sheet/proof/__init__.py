"""The proof of a cutting program: what its text does to the sheet, checked against the drawing."""
