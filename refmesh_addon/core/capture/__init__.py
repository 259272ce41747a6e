"""What scans bring: seams, patches turned inward, floaters; and what a check finds."""
