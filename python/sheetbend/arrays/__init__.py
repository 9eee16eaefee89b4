"""Arrays that come from users, that grow, and that are sampled over time."""
