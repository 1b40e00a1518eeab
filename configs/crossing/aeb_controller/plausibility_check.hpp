#pragma once
// Whether an object list is frozen: lists still come, but nothing updates their objects any more. An object
// has the time since its measurement, so in a live list it differs from one list to the next: it is older, or
// measured anew. In a frozen list every object stays as it is, whatever counters and checksums say.
//
// Not found: a list that becomes frozen while it has no object. An object counts as unchanged, too, while its
// age is beyond what its message can carry.
//
// Threads: one.

#include <cstdint>
#include <span>
#include <vector>

#include "configs/crossing/aeb_controller/object_report.hpp"

namespace hil::crossing::aeb {

class PlausibilityCheck {
 public:
  /// A list is frozen when no valid object has changed for `frozen_after_ns`.
  explicit PlausibilityCheck(std::int64_t frozen_after_ns) : frozen_after_ns_(frozen_after_ns) {}

  /// Takes a list, and returns whether it is frozen. While the ego is at rest a list does not become frozen,
  /// since the ego is no danger; a frozen list remains so until it changes. Times are strictly
  /// increasing.
  bool is_frozen(std::int64_t time_ns, bool is_at_rest, std::span<const ObjectReport> objects);

 private:
  std::int64_t frozen_after_ns_;
  std::int64_t unchanged_since_ns_ = 0;
  bool is_frozen_ = false;
  std::vector<ObjectReport> previous_;  ///< the valid objects of the list before
  std::vector<ObjectReport> current_;
};

}  // namespace hil::crossing::aeb
