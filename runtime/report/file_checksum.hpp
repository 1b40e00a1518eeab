#pragma once
// The checksum that report.json and world.json end with, so that a reader refuses a file that was cut or
// changed. It finds damage and hand-made changes, not a forger: whoever changes the file can write another
// checksum.
//
// The last line but one of the file is
//     "checksum": "xxh3:0123456789abcdef"
// with XXH3 of 64 bits, seed 0, over all bytes before that line.

#include <string>
#include <string_view>

namespace hil::report {

/// The text of a JSON object that has a member and no checksum, with its checksum as the last member.
std::string with_checksum(std::string json);

/// Empty, or what is wrong with the checksum of a text and what to do, as the end of a sentence that begins
/// with the file's name.
std::string checksum_fault(std::string_view text);

}  // namespace hil::report
