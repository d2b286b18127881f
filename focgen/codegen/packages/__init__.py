"""What a build system or a simulator expects beside the plain C: one file an ecosystem."""
