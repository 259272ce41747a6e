"""The one exception that is meant for a person."""


class RefMeshError(Exception):
    """Says what is wrong, where (file, frame or option) and what to do, in one line.

    Anything else that escapes is a fault of ours and is reported as such.
    """


class Cancelled(Exception):
    """Raised by a progress callback to stop the work between two steps."""
