"""What a scenario may say: schemas, and the files that it names."""
