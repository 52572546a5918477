"""The minimum-derivative pipeline: limits by cutting planes, infeasibility explained, free times, streams."""
