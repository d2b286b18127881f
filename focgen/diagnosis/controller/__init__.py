"""The controller's stage: how the running one departs from the one that its file describes."""
