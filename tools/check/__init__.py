"""`posebridge check`: does the autopilot use the poses, and may it fly on them?"""
