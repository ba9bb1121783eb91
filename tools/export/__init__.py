"""A log as files that other programs read: docs/export.md is its manual."""
