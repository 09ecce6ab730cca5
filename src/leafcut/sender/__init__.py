"""Programs go to a GRBL board over its serial port: read and checked first, then line by line, and stopped safely."""
