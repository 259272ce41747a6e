"""The exceptions that callers handle: a message for the user, and cancellation."""


class RefMeshError(Exception):
    """A message for the user, in one line: what is wrong, where (file, frame or option) and what to do.

    Any other exception that escapes is a bug and is reported as such.
    """


class Canceled(Exception):
    """Raised by a progress callback to stop the work between two steps."""
