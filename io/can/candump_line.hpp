#pragma once
// A line of a log of bus traffic in the format of `candump -l`, which canplayer can play:
//   (1436509052.249713) vcan0 044#2A366C2BBA      classic frame
//   (1436509052.249713) vcan0 12345678#R4         remote request
//   (1436509052.249713) vcan0 123##1AABBCC        FD frame: one hexadecimal digit of flags, then the payload
//   (1436509052.249713) vcan0 20000004#...        error frame
//   (1436509052.249713) vcan0 123#R8_C            data length code C of a classic frame of 8 bytes
//                                                 (candump -8); read, never written
// Times are Frame::wall_ns, cut to microseconds as candump does it; under the virtual clock that is run time.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "io/can/frame.hpp"

namespace hil::io::can {

/// Appends the frame's line, without a line end.
void append_candump_line(std::string& text, const Frame& frame, std::string_view interface);

struct LoggedFrame {
  std::string interface;
  Frame frame;  ///< wall_ns is the logged time, time_ns the same; tx where the line ends in T (candump -x)
};

/// Why a line does not have this format.
struct CandumpMistake {
  std::size_t column = 1;  ///< of the wrong field, from 1
  std::string text;        ///< what is wrong with it: a clause
};

/// Empty when the line does not have this format; then with the first mistake. Text after the frame other
/// than "T" is ignored (candump -x writes "R" or "T").
std::optional<LoggedFrame> parse_candump_line(std::string_view line, CandumpMistake* mistake = nullptr);

}  // namespace hil::io::can
