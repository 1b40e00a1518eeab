#pragma once
// How the frames of a type of bus are written into a recording.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace hil::contribution {

/// A member of the JSON object of a frame.
struct FrameMember {
  std::string name;
  std::string type;   ///< of JSON Schema: "number", "boolean", "string"
  std::string about;  ///< may be empty
};

struct FrameFormat {
  std::string schema_name;  ///< "hil.frame"
  std::vector<FrameMember> members{};
  /// The JSON object of a frame, whose bytes the device gave to io::FrameSink. An ordinary thread.
  std::string (*to_json)(std::span<const std::byte> frame) = nullptr;
};

}  // namespace hil::contribution
