"""Our methods beside the documented calls of toppra, ruckig and scipy, on the same problems and under one certificate.

Four parts: ``cases`` (the problems), ``adapters`` (one file a peer), ``rows`` (measure and judge), ``report`` (CSV and
Markdown); ``kernels`` and ``curves`` measure sampling, extrema, verdicts and the making of curves by themselves (what a
measure is: ``figures``), ``minimum_jerk``, ``path_timing`` and ``waypoints`` are comparisons of their own with splines
and solvers, ``service`` splits the time of a request. Run with ``make bench`` or ``python -m benchmarks``.
"""
