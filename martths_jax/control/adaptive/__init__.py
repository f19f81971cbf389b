"""The pieces of adaptive controllers, each exchangeable."""
