# Cyclone's plugin that checks permissions, a library without headers: ACCESS_CONTROL_PLUGIN. Debian has it in a folder of its own.
find_library(ACCESS_CONTROL_PLUGIN dds_security_ac PATH_SUFFIXES libddsc0debian)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(CycloneAccessControl REQUIRED_VARS ACCESS_CONTROL_PLUGIN)
