"""Compiled helpers behind one function each, imported late and only in the worker process."""
