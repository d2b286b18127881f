"""A plan printed as C: one typed context per template, the manifest, and whole folders."""
