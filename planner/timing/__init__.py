"""Timing: how fast a path may be run through, and the laws s(t) that do it."""
