"""Reliability campaigns: programs that attack a running service over HTTP and report how far they ran.

``python -m benchmarks.campaign --size ci`` runs all of them in minutes, ``--size campaign`` in hours; a run that was
killed goes on where it was. See docs/reliability.md.
"""
