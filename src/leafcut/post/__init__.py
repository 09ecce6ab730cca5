"""Post-processors: write a `Toolpath` in the dialect of a controller."""
