"""The method itself: numpy and scipy only; no files, prints, clock, global state or bpy."""
