"""Files of other programs: a file for each format that Blender loads or writes, and what the formats share."""
