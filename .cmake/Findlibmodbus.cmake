# modbus::modbus: the library for the Modbus protocol. It comes without a file for CMake.
find_path(LIBMODBUS_INCLUDE modbus/modbus.h)
find_library(LIBMODBUS_LIBRARY modbus)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(libmodbus REQUIRED_VARS LIBMODBUS_LIBRARY LIBMODBUS_INCLUDE)
if(libmodbus_FOUND AND NOT TARGET modbus::modbus)
  add_library(modbus::modbus UNKNOWN IMPORTED)
  set_target_properties(modbus::modbus PROPERTIES IMPORTED_LOCATION ${LIBMODBUS_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES ${LIBMODBUS_INCLUDE})
endif()
