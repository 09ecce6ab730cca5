"""Posts: a `Toolpath` in a controller's own words."""
