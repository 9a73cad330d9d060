"""What happens to the bodies: state, loads, reactions, motion."""
