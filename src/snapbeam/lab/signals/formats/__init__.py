"""The kinds of files a signal can live in: a reader, and for some a writer, in a file each."""
