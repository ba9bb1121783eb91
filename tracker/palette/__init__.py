"""What colours balls and room have, learned from footage before flight; the tracker itself needs none of it."""
