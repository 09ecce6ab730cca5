"""Sheets: the contours of a drawing become a cutting program for plasma, laser, flame or water."""
