"""Inertial parameters: how wrong they may be, and which of them a body could have."""
