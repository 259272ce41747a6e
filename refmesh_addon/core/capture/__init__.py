"""What scans bring: seams, patches that face inward and floaters, and the checks that report them."""
