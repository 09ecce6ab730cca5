"""Drilling: a drawing's holes and slots become a program for a drill or a mill."""
