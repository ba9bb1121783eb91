"""Data only: the configs that come with posebridge, to be named on the command line without a path."""
