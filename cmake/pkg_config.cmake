# Makes and installs `package`.pc of cmake/`package`.pc.in. Of the caller: the lists PC_REQUIRES_PRIVATE, of packages, and
# PC_LIBS_PRIVATE, of flags, files and names of libraries, in the order of linking.
function(raylign_pkg_config package)
  file(RELATIVE_PATH PC_PREFIX ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})  # moves with the prefix
  string(REGEX REPLACE "/$" "" PC_PREFIX ${PC_PREFIX})
  list(TRANSFORM PC_LIBS_PRIVATE REPLACE "^([A-Za-z0-9_+-]+)$" "-l\\1")
  list(TRANSFORM PC_LIBS_PRIVATE REPLACE "^-l-" "-")
  list(JOIN PC_REQUIRES_PRIVATE " " PC_REQUIRES_PRIVATE)
  list(JOIN PC_LIBS_PRIVATE " " PC_LIBS_PRIVATE)
  configure_file(${PROJECT_SOURCE_DIR}/cmake/${package}.pc.in ${PROJECT_BINARY_DIR}/${package}.pc.configured @ONLY)
  file(GENERATE OUTPUT ${PROJECT_BINARY_DIR}/${package}.pc INPUT ${PROJECT_BINARY_DIR}/${package}.pc.configured)
  install(FILES ${PROJECT_BINARY_DIR}/${package}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
endfunction()
