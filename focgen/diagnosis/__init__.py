"""Where the gap between a rig and its nominal model lies, which effect causes it, and how far it shrinks."""
