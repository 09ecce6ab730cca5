"""The page of the studio: its panels, its forms, and what one open page shows."""
