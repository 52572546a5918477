"""What the service tells about itself: metrics, a line per request, traces, and how late its event loop runs."""
