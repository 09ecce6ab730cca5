"""Drilling: convert the holes and slots of a drawing to a program for a drill or a mill."""
