"""The preflight verdict: what the autopilot says, judged by rules. Values in, values out; no port and no clock."""
