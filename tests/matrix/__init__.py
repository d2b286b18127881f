"""The same bytes, whatever Python, numpy, processor, locale, time zone, hash seed and number of threads."""
