"""Models of other programs: matrices with names, and OpenSees."""
