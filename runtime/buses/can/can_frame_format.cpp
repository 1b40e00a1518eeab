#include "runtime/buses/can/can_frame_format.hpp"

#include <string_view>

#include "io/can/bus_frame.hpp"
#include "io/frame_sink.hpp"

namespace hil::buses::can {
namespace {

/// The data length code of a frame with this number of bytes.
unsigned length_code(std::uint8_t size) {
  if (size <= 8) return size;
  return size <= 24 ? 9U + (size - 12U) / 4U : 13U + (size - 32U) / 16U;
}

std::string to_json(std::span<const std::byte> bytes) {
  const auto frame = io::frame_of<io::can::BusFrame>(bytes);
  constexpr std::string_view digits = "0123456789abcdef";
  std::string data;
  for (std::size_t i = 0; !frame.remote && i < frame.size; ++i) {
    data += digits[frame.data[i] >> 4U];
    data += digits[frame.data[i] & 0xFU];
  }
  const char* const kind = frame.error ? "error" : frame.remote ? "remote" : "data";
  return std::string("{\"id\":") + std::to_string(frame.id) +
         ",\"extended\":" + (frame.extended ? "true" : "false") + ",\"direction\":\"" +
         (frame.sent ? "tx" : "rx") + "\",\"kind\":\"" + kind + "\",\"fd\":" + (frame.fd ? "true" : "false") +
         ",\"dlc\":" + std::to_string(length_code(frame.size)) + ",\"data\":\"" + data + "\"}";
}

}  // namespace

contribution::FrameFormat can_frame_format() {
  return {.schema_name = "hil.frame",
          .members = {{"id", "number", "without flags; of an error frame its class"},
                      {"extended", "boolean", "the identifier has 29 bits"},
                      {"direction", "string", "tx: sent by the run; rx: received"},
                      {"kind", "string", "data, remote or error"},
                      {"fd", "boolean", ""},
                      {"dlc", "number", "data length code"},
                      {"data", "string", "bytes in hexadecimal digits"}},
          .to_json = to_json};
}

}  // namespace hil::buses::can
