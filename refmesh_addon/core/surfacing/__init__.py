"""From oriented points to a closed surface of evenly sized triangles."""
