"""Settings of controllers, each read into the values of a machine profile: a module for each kind of file."""
