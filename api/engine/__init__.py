"""Solving out of the event loop: jobs, the lane each takes, and the processes that solve them."""
