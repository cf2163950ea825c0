# Makes OUTPUT, a script for a page, from package-lock.json with npm: cmake -DNPM= -DSOURCE= -DFILES=a;b -DRESULT= -DWORK= -DOUTPUT=
# -DMUST= -DWHAT= -P. FILES of SOURCE go to WORK, where `npm run bundle` makes RESULT.
# Without npm, or without its registry, OUTPUT is empty (unless MUST), and the pages say what is missing.
file(MAKE_DIRECTORY ${WORK})
foreach(file IN LISTS FILES)
  file(COPY ${SOURCE}/${file} DESTINATION ${WORK})
endforeach()
set(problem "npm is not installed")
if(NPM)
  execute_process(COMMAND ${NPM} ci --ignore-scripts --no-audit --no-fund WORKING_DIRECTORY ${WORK} RESULT_VARIABLE failed
                  OUTPUT_VARIABLE output ERROR_VARIABLE output TIMEOUT 300)
  if(failed)
    set(problem "npm: ${output}")
  else()
    execute_process(COMMAND ${NPM} run bundle WORKING_DIRECTORY ${WORK} RESULT_VARIABLE failed OUTPUT_VARIABLE output
                    ERROR_VARIABLE output TIMEOUT 120)
    if(failed)  # a fault of the sources, not of the machine
      message(FATAL_ERROR "${WHAT} cannot be bundled: ${output}")
    endif()
    file(COPY_FILE ${WORK}/${RESULT} ${OUTPUT})
    return()
  endif()
endif()
if(MUST)
  message(FATAL_ERROR "RAYLIGN_REPORT_CHARTS=ON, but ${WHAT} cannot be bundled: ${problem}")
endif()
message(STATUS "built without ${WHAT}: ${problem}")
file(WRITE ${OUTPUT} "")
