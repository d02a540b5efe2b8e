"""One module a family of file formats: bytes to named columns.  Nothing here knows what a column means."""
