"""What each result looks like on a page: sentences first, then figures with their numbers."""
