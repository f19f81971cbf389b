"""Arrays in, arrays out: algebra that knows no actuator and no frame."""
