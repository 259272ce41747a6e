"""Stages in order, the job that caches them, and the process that runs them; no bpy."""
