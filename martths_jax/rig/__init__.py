"""What the laboratory has: actuators and their coupler, sensors, specimens."""
