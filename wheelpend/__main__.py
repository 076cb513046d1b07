"""`python -m wheelpend` is the `wheelpend` command."""

from wheelpend.cli.main import main

main()
