"""The page of the studio: its panels, its forms, and the state of each open page."""
