"""A problem as a TOML file."""
