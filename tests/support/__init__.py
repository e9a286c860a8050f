"""What tests share: runs, buses, judges, feeders."""
