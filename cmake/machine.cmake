# What the code counts on: 64-bit addresses (a CT is larger than 2 GiB of them, and offsets are std::ptrdiff_t) and the least
# significant byte first (files are read and written that way). Variables as project() sets them; tests/install runs it alone.
if(CMAKE_SIZEOF_VOID_P LESS 8)
  message(FATAL_ERROR "raylign needs a 64-bit system, and this compiler (${CMAKE_CXX_COMPILER}) makes programs with addresses of "
                      "${CMAKE_SIZEOF_VOID_P} bytes. Take a 64-bit compiler, or leave out -m32.")
endif()
if(CMAKE_CXX_BYTE_ORDER STREQUAL "BIG_ENDIAN")
  message(FATAL_ERROR "raylign needs a little-endian processor, and this compiler (${CMAKE_CXX_COMPILER}) makes programs for a "
                      "big-endian one (${CMAKE_SYSTEM_PROCESSOR}): files would be read with their bytes the wrong way round.")
endif()
