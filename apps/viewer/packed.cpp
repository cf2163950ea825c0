#include "apps/viewer/packed.h"

#include <zlib.h>

#include "apps/report_page/report_page.h"
#include "core/base/error.h"

namespace raylign::detail::apps {

std::string packed(std::span<const std::uint8_t> bytes) {
    uLongf size = compressBound(bytes.size());
    std::string deflated(size, '\0');
    const int status = compress2(reinterpret_cast<Bytef*>(deflated.data()), &size, bytes.data(), bytes.size(), 6);
    if (status != Z_OK) throw Error("zlib cannot pack what goes into the page: " + std::string(zError(status)));
    deflated.resize(size);
    return base64(deflated);
}

}  // namespace raylign::detail::apps
