"""One form fitted to one stretch: where it begins, what noise leaves of it, how far two fits are apart."""
