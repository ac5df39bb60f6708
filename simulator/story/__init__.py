"""What a robot saw and what was true, step by step: memories of any time, to look back at."""
