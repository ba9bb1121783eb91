"""The state of a running bridge, for whoever watches: gathered in bounded memory, sent over loopback, never waited for."""
