"""The free-path pipeline: trajectories through waypoints, the path between them and the times left free."""
