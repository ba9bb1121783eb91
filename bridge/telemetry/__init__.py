"""A running bridge's state for whoever watches: gathered in bounded memory, sent over loopback, never waited for."""
