"""What a diagnosis leaves open, and the motion that would decide it."""
