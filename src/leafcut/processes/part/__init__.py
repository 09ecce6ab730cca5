"""Mill a whole part from a drawing: its outlines, openings and holes, with tabs."""
