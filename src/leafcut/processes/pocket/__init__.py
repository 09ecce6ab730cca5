"""Pocket milling: convert the pockets in a drawing or a picture to a milling program."""
