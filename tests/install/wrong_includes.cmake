# Compiles one line against each target's include tree: allowed headers must be found, others not.
function(expect target header compiles)
  file(WRITE ${BUILD}/include_probe.cpp "#include \"${header}\"\n")
  execute_process(COMMAND ${CXX} -std=c++20 -fsyntax-only -I${BUILD}/include/raylign_base -I${BUILD}/include/${target}
                          -isystem /usr/include/eigen3 ${BUILD}/include_probe.cpp
                  RESULT_VARIABLE result ERROR_VARIABLE error)
  if(result EQUAL 0)
    set(found YES)
  else()
    set(found NO)
  endif()
  if(NOT found STREQUAL compiles)
    message(FATAL_ERROR "${target} including ${header}: expected ${compiles}, got ${found}\n${error}")
  endif()
endfunction()

expect(raylign_geometry raylign/camera.h YES)
expect(raylign_geometry raylign/image.h NO)
expect(raylign_image core/similarity/similarity.h NO)
expect(raylign_optimize raylign/camera.h NO)
expect(raylign_reference backends/reference/reference_backend.h NO)  # needs core, which comes by its link, not by luck
expect(raylign_reference raylign/backends.h NO)
expect(raylign_reference backends/cpu/cpu_backend.h NO)
if(EXISTS ${BUILD}/include/raylign_cpu)
  expect(raylign_cpu backends/reference/reference_backend.h NO)
  expect(raylign_cpu raylign/backends.h NO)
endif()
