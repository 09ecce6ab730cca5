"""Send programs to GRBL and Marlin boards: read and check, send line by line, stop safely."""
