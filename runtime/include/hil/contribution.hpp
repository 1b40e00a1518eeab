#pragma once
// What modules contribute to the report of a run.
//
// Threads: plain data, filled after the last tick.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <hil/map.hpp>
#include <hil/record.hpp>
#include <hil/section.hpp>

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

/// A file in the folder `files` of the run.
struct File {
  std::string name;  ///< without folders; unique in the run
  std::string content;
};

struct Contribution {
  std::int64_t end_ns = 0;  ///< run time at which the run ended: the instant that the map shows
  std::vector<Event> events;
  Map map;
  std::vector<Section> sections;
  std::vector<Image> images;
  std::vector<File> files;
  /// Records of the module in lists of report.json: key `lists`, there the list that the record names.
  std::vector<ModuleRecord> lists;

  /// The section with this title, which several modules may share; it is made at the first call.
  Section& section(const std::string& title) {
    const auto found = std::ranges::find(sections, title, &Section::title);
    return found != sections.end() ? *found : sections.emplace_back(Section{.title = title});
  }
};

}  // namespace hil::contribution
