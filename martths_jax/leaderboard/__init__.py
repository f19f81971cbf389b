"""The leaderboard: all controllers on the same plants, noise and motions."""
