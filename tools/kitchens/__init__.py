"""Homes recorded by the minute: a robot looks around there, and finders are asked for things."""
