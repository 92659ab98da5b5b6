"""The command line: thin commands that parse, call, write; one small file each."""
