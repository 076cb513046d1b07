"""`python -m wheelpend` is the `wheelpend` command."""

from wheelpend.cli import main

main()
