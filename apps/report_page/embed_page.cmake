# Makes OUTPUT, a C++ file, from text files: cmake -DOUTPUT= -DHEADER= -DFILES=name=path|path;... -P. Files joined by | become one. Bytes, not
# string literals: those have a largest length.
set(text "#include \"${HEADER}\"\n\nnamespace raylign::detail::apps {\n")
foreach(entry IN LISTS FILES)
  string(REGEX MATCH "^([^=]+)=(.*)$" entry ${entry})
  set(name ${CMAKE_MATCH_1})
  string(REPLACE "|" ";" paths ${CMAKE_MATCH_2})
  set(hex "")
  foreach(path IN LISTS paths)
    file(READ ${path} more HEX)
    string(APPEND hex "${more}")
  endforeach()
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "'\\\\x\\1'," bytes "${hex}")
  string(APPEND text "static const char ${name}_bytes[] = {${bytes}'\\0'};\n"
                     "std::string_view ${name}() { return {${name}_bytes, sizeof ${name}_bytes - 1}; }\n")
endforeach()
file(WRITE ${OUTPUT} "${text}}  // namespace raylign::detail::apps\n")
