"""Pockets: regions of a drawing or a picture become a milling program."""
