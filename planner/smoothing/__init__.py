"""The minimum-derivative pipeline: elimination, cutting planes, infeasibility explained."""
