#pragma once
// The output of a module that is the time until an impact, from an answer of the database. Threads: one.

#include <array>
#include <cstdint>
#include <string>

#include <hil/event_log.hpp>
#include <hil/world/world_module.hpp>
#include <rtstdb/impact.hpp>

namespace hil::modules {

class TimeToImpact {
 public:
  /// Adds the kinds of events. `subject`: whose time it is, for their texts.
  TimeToImpact(EventLog& events, const std::string& subject);

  /// Seconds until the impact; the window if there is none in it; NaN if that is not known. An event has the
  /// reason when a time is no longer known, and when the reason changes.
  double take(WorldStep& context, const rtstdb::ImpactAnswer& answer, rtstdb::Nanoseconds window) noexcept;

 private:
  /// Why a time is not known.
  enum class Unknown : std::uint8_t { none, steps, distance, capacity, incomplete };
  static Unknown unknown_by(const rtstdb::ImpactAnswer& answer) noexcept;

  std::array<EventLog::Kind, 5> kinds_;
  Unknown last_ = Unknown::none;
};

}  // namespace hil::modules
