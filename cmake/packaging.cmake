# `cpack -G DEB`: raylign, libraylign-dev, python3-raylign, for the release of Debian or Ubuntu that it runs on (preset
# "packages"). `cpack -G TGZ`: a folder with the program and the libraries that it needs. Both of archives, not of shared
# libraries of ours, and whatever the umask.
if(NOT TARGET raylign OR BUILD_SHARED_LIBS OR RAYLIGN_SANITIZE)
  return()
endif()
set(CPACK_PACKAGE_VENDOR raylign)
set(RAYLIGN_PACKAGE_MAINTAINER "The raylign developers <raylign@localhost>" CACHE STRING "Whom packages name as maintainer")
set(CPACK_PACKAGE_CONTACT "${RAYLIGN_PACKAGE_MAINTAINER}")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_SYSTEM_NAME ${CMAKE_SYSTEM_NAME}-${CMAKE_SYSTEM_PROCESSOR})
set(CPACK_STRIP_FILES ON)
set(CPACK_PRE_BUILD_SCRIPTS ${PROJECT_SOURCE_DIR}/cmake/packaging_rights.cmake)
set(CPACK_COMPONENTS_ALL program development)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

# Every package says under which licence it comes.
function(raylign_copyright component package)
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${component} RENAME copyright)
  install(FILES ${PROJECT_SOURCE_DIR}/third_party_notes.md DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${component})
endfunction()

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME raylign)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "libegl1, libgl1-mesa-dri")  # opened at run time, by the backends gl
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "Finds the pose of a CT at which simulated X-rays match real ones.
 The program, its man pages and completions for bash, zsh and fish.")
raylign_copyright(program raylign)

# What find_package(raylign COMPONENTS io) and pkg-config ask for.
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libraylign-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libeigen3-dev, libnlopt-dev, libinsighttoolkit5-dev, libfftw3-dev, libexpat1-dev, \
libassimp-dev, libmeshoptimizer-dev, libhdf5-dev, libjpeg-dev, nlohmann-json3-dev, libssl-dev, libpng-dev, libtiff-dev, libyaml-cpp-dev, zlib1g-dev, libgdcm-dev")
if(RAYLIGN_BUILD_CPU)
  string(APPEND CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS ", libtbb-dev")
endif()
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "2-D/3-D registration of CT to X-rays, for C++20.
 Headers, archives, and what CMake and pkg-config ask for.")
raylign_copyright(development libraylign-dev)

if(TARGET raylign_python)
  list(APPEND CPACK_COMPONENTS_ALL python)
  find_package(Python3 REQUIRED COMPONENTS Interpreter)  # the same as in apps/python, whose variables end there
  set(minor ${Python3_VERSION_MINOR})  # the module is compiled for one version
  math(EXPR next "${minor} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-raylign)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= 3.${minor}), python3 (<< 3.${next}), python3-numpy")
  # Compiled modules come and go with the package.
  set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/cmake/debian_python/postinst
      ${PROJECT_SOURCE_DIR}/cmake/debian_python/prerm)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "python3-matplotlib, python3-nibabel, python3-torch")
  set(CPACK_COMPONENT_PYTHON_DESCRIPTION "2-D/3-D registration of CT to X-rays, for Python and NumPy.
 Registers, tracks, simulates X-rays; building blocks for optimizers of one's own.")
  raylign_copyright(python python3-raylign)
endif()

# The folder: the program, then what it needs beside it.
install(CODE "
  set(README ${PROJECT_SOURCE_DIR}/cmake/folder_readme.txt.in)
  set(LICENCE ${PROJECT_SOURCE_DIR}/LICENSE)
  set(VERSION ${PROJECT_VERSION})
  set(PROGRAM \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_BINDIR}/raylign\")
  include(${PROJECT_SOURCE_DIR}/cmake/folder.cmake)" COMPONENT folder EXCLUDE_FROM_ALL)
set(CPACK_PROJECT_CONFIG_FILE ${PROJECT_BINARY_DIR}/packaging_by_generator.cmake)
file(WRITE ${CPACK_PROJECT_CONFIG_FILE} "if(CPACK_GENERATOR STREQUAL \"TGZ\")
  set(CPACK_INSTALL_CMAKE_PROJECTS \"${PROJECT_BINARY_DIR};raylign;program;/;${PROJECT_BINARY_DIR};raylign;folder;/\")
elseif(NOT \"${CMAKE_INSTALL_LIBDIR}\" STREQUAL \"lib/${CMAKE_LIBRARY_ARCHITECTURE}\")
  message(FATAL_ERROR \"Debian's packages have libraries in lib/${CMAKE_LIBRARY_ARCHITECTURE}: use the preset packages\")
endif()
")
set(CPACK_SOURCE_GENERATOR "")
include(CPack)
