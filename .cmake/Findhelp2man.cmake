# HELP2MAN: the program that makes a manual page from what --help says.
find_program(HELP2MAN help2man)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(help2man REQUIRED_VARS HELP2MAN)
