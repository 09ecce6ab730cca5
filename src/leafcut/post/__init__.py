"""Post-processors, which write a `Toolpath` in the dialect of a controller."""
