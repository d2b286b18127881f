"""Input from strangers, by the million: led mutations of every file, command line and folder that is read."""
