"""Problems: a structure, what of it stands in the laboratory, and the rig that moves it."""
