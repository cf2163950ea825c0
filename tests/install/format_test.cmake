# Every source is as clang-format leaves it.
file(GLOB_RECURSE files ${ROOT}/core/*.h ${ROOT}/core/*.cpp ${ROOT}/backends/*.h ${ROOT}/backends/*.cpp ${ROOT}/apps/*.h
     ${ROOT}/apps/*.cpp ${ROOT}/bench/*.h ${ROOT}/bench/*.cpp ${ROOT}/tests/*.h ${ROOT}/tests/*.cpp)
execute_process(COMMAND ${CLANG_FORMAT} --dry-run --Werror ${files} RESULT_VARIABLE result ERROR_VARIABLE error)
if(NOT result EQUAL 0)
  string(SUBSTRING "${error}" 0 3000 error)
  message(FATAL_ERROR "not formatted (clang-format -i mends it):\n${error}")
endif()
