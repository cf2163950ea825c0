#include "raylign/version.h"

namespace raylign {

const char* version() noexcept { return RAYLIGN_VERSION; }

}  // namespace raylign
