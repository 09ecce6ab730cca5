"""Drilling: turn the holes and slots of a drawing into a program for a drill or a mill."""
