# Installed as raylign::core and raylign::backends, which need no ITK, and raylign::io (component "io"), which does; for
# pkg-config as raylign and (core/io) raylign-io.
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/raylign)
function(raylign_install export)
  install(TARGETS ${ARGN} EXPORT ${export}
          ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
          LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT libraries NAMELINK_COMPONENT development)
  foreach(target IN LISTS ARGN)
    target_include_directories(${target} INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
    target_compile_features(${target} INTERFACE cxx_std_20)  # the headers use std::span
    # Before 1.0 a minor version may change what programs were compiled against.
    set_target_properties(${target} PROPERTIES DEFINE_SYMBOL "" VERSION ${PROJECT_VERSION}
                          SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  endforeach()
  install(EXPORT ${export} NAMESPACE raylign:: DESTINATION ${package_dir} COMPONENT development)
endfunction()

set(backends raylign_reference)
if(TARGET raylign_cpu)
  list(APPEND backends raylign_cpu)
endif()
if(TARGET raylign_gl)
  list(APPEND backends raylign_gl)
endif()
if(BUILD_SHARED_LIBS)
  raylign_install(raylignTargets raylign_core raylign_backends)  # the backends are in raylign_backends
else()
  raylign_install(raylignTargets raylign_core raylign_backends ${backends})
endif()
install(DIRECTORY core/include/raylign DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development
        PATTERN io EXCLUDE PATTERN io.h EXCLUDE)
if(TARGET raylign_io)
  raylign_install(raylignIoTargets raylign_io)
  install(FILES core/include/raylign/io.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/raylign COMPONENT development)
  install(DIRECTORY core/include/raylign/io DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/raylign COMPONENT development)
endif()
if(TARGET raylign)
  install(TARGETS raylign RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
  include(cmake/manuals.cmake)
endif()

configure_package_config_file(cmake/raylignConfig.cmake.in raylignConfig.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(raylignConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/raylignConfig.cmake ${PROJECT_BINARY_DIR}/raylignConfigVersion.cmake
        DESTINATION ${package_dir} COMPONENT development)

# What archives need; pkg-config tells it to those who ask with --static.
if(NOT BUILD_SHARED_LIBS)
  set(PC_REQUIRES_PRIVATE nlopt)
  if(TARGET raylign_cpu)
    list(APPEND PC_REQUIRES_PRIVATE tbb)
  endif()
  list(TRANSFORM backends PREPEND -l OUTPUT_VARIABLE PC_LIBS_PRIVATE)
  list(APPEND PC_LIBS_PRIVATE -lraylign_core ${CMAKE_THREAD_LIBS_INIT} ${CMAKE_DL_LIBS})
endif()
raylign_pkg_config(raylign)
