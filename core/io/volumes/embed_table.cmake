# Writes OUTPUT, a C++ file with the text of FILE, for label_names.cpp.
file(READ ${FILE} text)
file(WRITE ${OUTPUT} "#include \"core/io/volumes/label_table_text.h\"

namespace raylign::detail {

std::string_view total_segmentator_table() {
    return R\"RAYLIGN(${text})RAYLIGN\";
}

}  // namespace raylign::detail
")
