"""What the laboratory has: actuators with their uncertain plants, coupler, specimens."""
