"""Color on one layout: texels, baking, exposure, one steady texture, and drift seen by color."""
