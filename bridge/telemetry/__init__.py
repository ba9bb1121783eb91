"""The state of a running bridge, for whoever watches: bounded in memory, sent over loopback, never waited for."""
