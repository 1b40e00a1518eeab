#pragma once
// The first contact of each pair of bodies: when, where and how fast. For events, and for a table of the
// report.
//
// Threads: add_kinds while configuring; note_first in the tick, without allocation; table after the last
// tick.

#include <glm/ext/vector_double3.hpp>

#include <cstdint>
#include <string>
#include <vector>

#include <hil/event_log.hpp>
#include <hil/section.hpp>

namespace hil::modules {

struct Touch {
  std::uint32_t first = 0, second = 0;  ///< numbers of the bodies
  std::int64_t time_ns = 0;
  glm::dvec3 place_m{0.0};  ///< world frame
  double closing_speed_mps = 0.0;
  double depth_m = 0.0;
};

class TouchLog {
 public:
  explicit TouchLog(std::vector<std::string> names);

  /// One kind of event for each pair of which a body moves, as `moves` says for each body. `events` outlives
  /// the log.
  void add_kinds(EventLog& events, const std::vector<bool>& moves);
  /// Keeps and reports the first contact of each pair. Misuse: before add_kinds.
  void note_first(const Touch& touch) noexcept;
  std::size_t count() const noexcept { return touches_.size(); }
  contribution::Table table() const;

 private:
  /// The place of a pair, in either order, in kinds_ and has_touched_.
  std::size_t index_of(std::uint32_t first, std::uint32_t second) const noexcept;

  const std::vector<std::string> names_;
  EventLog* events_ = nullptr;
  std::vector<EventLog::Kind> kinds_;  ///< by index_of
  std::vector<bool> has_touched_;      ///< by index_of
  std::vector<Touch> touches_;
};

}  // namespace hil::modules
