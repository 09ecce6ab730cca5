"""Page of the studio: panels, forms, and the state of an open page."""
