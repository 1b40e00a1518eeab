#pragma once
// The checksum at the end of report.json and world.json. By it a reader refuses a file that was cut off or
// changed. It detects damage and accidental changes, not forgery, since a forger can write a new checksum.
//
// The second-to-last line of the file is
//     "checksum": "xxh3:0123456789abcdef"
// with XXH3 of 64 bits, seed 0, over all bytes before that line.

#include <string>
#include <string_view>

namespace hil::report {

/// Adds the checksum as the last member to the text of a JSON object that has at least one member.
std::string with_checksum(std::string json);

/// The end of a sentence that begins with the file's name: what is wrong with the checksum and what to do.
/// Empty: the checksum is right.
std::string checksum_fault(std::string_view text);

}  // namespace hil::report
