"""The drawing: scenes, the page elements that display them, and manual changes of the order."""
