"""What each candidate explanation adds to the torque along a recording, and how a model's torque is summed from it."""
