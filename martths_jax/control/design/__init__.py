"""Controller and filter design as differentiable functions of their weights."""
