"""Operations on flat arrays: groups of rows, growing tables."""
