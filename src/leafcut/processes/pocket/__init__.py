"""Pocket milling: convert regions of a drawing or a picture to a milling program."""
