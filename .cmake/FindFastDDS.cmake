# Fast DDS, the DDS of another vendor: FASTDDSGEN, which compiles IDL for it, FASTDDS_LIBRARY and FASTCDR_LIBRARY.
find_program(FASTDDSGEN fastddsgen)
# Debian 12 has Fast DDS 2, whose library is called fastrtps, Debian 13 has version 3.
find_library(FASTDDS_LIBRARY NAMES fastrtps fastdds)
find_library(FASTCDR_LIBRARY fastcdr)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(FastDDS REQUIRED_VARS FASTDDSGEN FASTDDS_LIBRARY FASTCDR_LIBRARY)
