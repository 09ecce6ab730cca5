"""Drawing: scenes, the page elements that show them, and manual changes of the order."""
