"""Generated C compared with the reference, in every bit."""
