#include "configs/crossing/aeb_controller/plausibility_check.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace hil::crossing::aeb {

bool PlausibilityCheck::is_frozen(std::int64_t time_ns, bool is_at_rest,
                                  std::span<const ObjectReport> objects) {
  current_.clear();
  std::ranges::copy_if(objects, std::back_inserter(current_), &ObjectReport::valid);
  const bool has_changed = current_.empty() || current_ != previous_;
  std::swap(current_, previous_);
  if (has_changed || (is_at_rest && !is_frozen_)) {
    unchanged_since_ns_ = time_ns;
    is_frozen_ = false;
  } else if (time_ns - unchanged_since_ns_ >= frozen_after_ns_) {
    is_frozen_ = true;
  }
  return is_frozen_;
}

}  // namespace hil::crossing::aeb
