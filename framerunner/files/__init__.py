"""Files that people write or read: one reader of texts, and the writer that replaces a file as a whole."""
