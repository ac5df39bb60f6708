"""Homes with people in them: residents with habits, who take things, use them and leave them."""
