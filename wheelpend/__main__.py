"""`python -m wheelpend` is the `wheelpend` command."""

from wheelpend.isolation import leave_out_current_folder

leave_out_current_folder()  # `-m` puts it in front of everything, and it may be that of somebody else's logs

from wheelpend.cli.main import main  # noqa: E402

main()
