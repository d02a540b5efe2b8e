"""What people and other programs read: findings, verdict, notes, views, and files."""
