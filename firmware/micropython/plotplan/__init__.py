"""Executes tick lines of plotplan on two DC motors with encoders and a pen servo."""
