"""What all stretches together amount to: the rigs, where, how sure, how far the gap goes away."""
