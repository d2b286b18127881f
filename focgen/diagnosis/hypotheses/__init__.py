"""Which effects a stretch needs: searched, accepted, held against their rivals."""
