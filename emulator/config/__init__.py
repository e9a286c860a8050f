"""What a scenario may state: schemas, and the files that it names."""
