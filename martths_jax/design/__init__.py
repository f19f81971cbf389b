"""Controller and filter design as differentiable functions of their weights.

``riccati`` holds the equations, ``lqg`` the designs; import from the one you need.
"""
