# `cmake --install` puts the programs and what belongs to them in place; the libraries do so themselves. The list of all
# files is in manager/install.md, and a test compares it with what is there.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

install(TARGETS plchostd plchost-dds plc-instance plcctl RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT plchost)

# The results of the build beside the programs.
install(DIRECTORY ${CMAKE_BINARY_DIR}/share/man/ DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT plchost)
install(DIRECTORY ${CMAKE_BINARY_DIR}/share/bash-completion ${CMAKE_BINARY_DIR}/share/zsh ${CMAKE_BINARY_DIR}/share/fish
  DESTINATION ${CMAKE_INSTALL_DATADIR} COMPONENT plchost)

# Units name absolute paths, and `cmake --install --prefix` may choose another prefix than was configured.
function(plchost_unit file)
  cmake_path(GET file STEM LAST_ONLY name)
  install(CODE "
    set(bin_folder \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_BINDIR}\")
    set(doc_folder \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DOCDIR}\")
    configure_file(\"${PROJECT_SOURCE_DIR}/${file}\" \"${CMAKE_BINARY_DIR}/${name}\" @ONLY)
    file(INSTALL \"${CMAKE_BINARY_DIR}/${name}\" DESTINATION \"\${CMAKE_INSTALL_PREFIX}/lib/systemd/system\")"
    COMPONENT plchost)
endfunction()
plchost_unit(manager/plchostd.service.in)
plchost_unit(manager/plchost-instances.service.in)
install(FILES manager/plchost.sysusers DESTINATION lib/sysusers.d RENAME plchost.conf COMPONENT plchost)
if(TARGET plchost-modbus)
  plchost_unit(instances/io/modbus/plchost-modbus@.service.in)
endif()

# For applications: their headers, and the flags that they are built with.
install(FILES instances/plc_app.h instances/plc_app.hpp instances/plc_debug.h instances/plc_instance.h instances/plc_online_change.h instances/plc_variables.h instances/plc_variables.hpp
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/plchost COMPONENT plchost-dev)
install(DIRECTORY ${CMAKE_BINARY_DIR}/share/plchost/adapters DESTINATION ${CMAKE_INSTALL_DATADIR}/plchost COMPONENT plchost)
install(FILES api/control.idl DESTINATION ${CMAKE_INSTALL_DATADIR}/plchost COMPONENT plchost-dev)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/plchost)
configure_package_config_file(.cmake/plchostConfig.cmake.in ${CMAKE_BINARY_DIR}/plchostConfig.cmake
  INSTALL_DESTINATION ${package_folder} PATH_VARS CMAKE_INSTALL_INCLUDEDIR)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/plchostConfigVersion.cmake COMPATIBILITY SameMajorVersion)
install(FILES ${CMAKE_BINARY_DIR}/plchostConfig.cmake ${CMAKE_BINARY_DIR}/plchostConfigVersion.cmake
  DESTINATION ${package_folder} COMPONENT plchost-dev)

# The documents, and what they link to, in the folders in which they link to it.
file(GLOB_RECURSE documents RELATIVE ${PROJECT_SOURCE_DIR} CONFIGURE_DEPENDS *.md *.svg
  instances/debugging/vscode/*.json instances/examples/*.c instances/examples/*.cpp instances/examples/*.hpp instances/examples/*.cfg
  instances/examples/*.py instances/examples/*.st instances/examples/*.toml api/library/examples/*.cpp api/library/examples/*.py)
foreach(document ${documents})
  if(document MATCHES "^(manager|schedulers|instances|shm|api|tests)/|^README.md$")
    cmake_path(GET document PARENT_PATH folder)
    install(FILES ${document} DESTINATION ${CMAKE_INSTALL_DOCDIR}/${folder} COMPONENT plchost-doc)
  endif()
endforeach()
