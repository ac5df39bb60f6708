"""What the eyes of robots are right about, held against the truth of homes of boxes."""
