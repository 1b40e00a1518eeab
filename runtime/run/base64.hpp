#pragma once
// Base64 with padding (RFC 4648, section 4).
//
// Threads: pure function.

#include <string>
#include <string_view>

namespace hil::run {

std::string base64(std::string_view bytes);

}  // namespace hil::run
