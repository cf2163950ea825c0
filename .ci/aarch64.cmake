# CMake's toolchain for 64-bit Arm on another processor: Debian's cross compiler, libraries from .ci/arm_root, programs run by QEMU.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)
set(RAYLIGN_ARM_ROOT "" CACHE PATH "Folder that .ci/arm_root filled")
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES RAYLIGN_ARM_ROOT)
set(CMAKE_FIND_ROOT_PATH ${RAYLIGN_ARM_ROOT})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE BOTH)  # Eigen and xsimd are headers only: this machine's
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE BOTH)
set(CMAKE_CROSSCOMPILING_EMULATOR
    qemu-aarch64 -L /usr/aarch64-linux-gnu -E LD_LIBRARY_PATH=${RAYLIGN_ARM_ROOT}/usr/lib/aarch64-linux-gnu)
