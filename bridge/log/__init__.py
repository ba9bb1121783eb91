"""The flight log: what is in it, how it is written, how it is read. docs/log-format.md is its manual."""
