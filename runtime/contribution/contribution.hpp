#pragma once
// What modules contribute to the report of a run.
//
// Threads: plain data, filled after the last tick.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "runtime/contribution/map.hpp"
#include "runtime/contribution/section.hpp"

namespace hil::contribution {

/// The most events of modules, stimuli and faults that a report lists.
inline constexpr std::size_t max_listed_events = 4096;

/// Something that happened at one instant: a light changed, braking began.
struct Event {
  std::int64_t time_ns = 0;
  std::string text;
};

/// A grey image, which the run writes as images/<name>.png: rows from the top, pixels from the left, 0 black.
struct Image {
  std::string name;  ///< letters, digits, '_' and '-'; unique in the run
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<std::uint8_t> grey;  ///< width * height
};

/// What a camera took.
struct Camera {
  std::string name;  ///< of the module
  std::uint64_t images = 0;
  std::uint64_t missing_tiles = 0;  ///< in all images
  double exposure_value = 0.0;
};

struct Contribution {
  std::int64_t end_ns = 0;  ///< run time at which the run ended: the instant that the map shows
  std::vector<Event> events;
  Map map;
  std::vector<Section> sections;
  std::vector<Image> images;
  std::vector<Camera> cameras;
};

}  // namespace hil::contribution
