"""Controllers and estimators: what they are (``base``), and the ones there are."""
