"""Write a program with its cuts and holes in a new order, and keep the text of the original where possible."""
