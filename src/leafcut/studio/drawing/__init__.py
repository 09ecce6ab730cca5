"""The drawing of the studio: scenes, the elements that show them, and an order that is changed on it by hand."""
