"""A folder with a page that plays a small GLB in a web browser."""
