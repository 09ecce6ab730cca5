"""Write a program with its cuts and holes in a new order. The original text is kept wherever possible."""
