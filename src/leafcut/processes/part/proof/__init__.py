"""The judge of a part: a module for each operation, which reads neither the plan nor its motion."""
