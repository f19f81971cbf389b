"""The rig of any problem: actuators, their uncertain plants, and what couples them to a frame."""
