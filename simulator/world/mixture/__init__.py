"""A mixture of homes: of all sizes, rules and lengths, known to their agents more or less well."""
