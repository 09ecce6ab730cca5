"""Write a program with its cuts and holes in a new order, mostly with the text of the original."""
