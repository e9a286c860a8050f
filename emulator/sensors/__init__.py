"""What the craft measures beside ranges: attitude."""
