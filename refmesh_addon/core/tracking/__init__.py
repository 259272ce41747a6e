"""Centers that follow the volume of a sequence."""
