#pragma once
// The identifiers that a station receives, with the semantics of CAN_RAW_FILTER for struct can_filter.

#include <linux/can.h>

#include <algorithm>
#include <span>
#include <vector>

namespace hil::io::can {

class FilterSet {
 public:
  /// A frame passes when any filter matches. An empty list lets every frame pass.
  void assign(std::span<const can_filter> filters) { filters_.assign(filters.begin(), filters.end()); }

  bool passes(canid_t can_id) const noexcept {
    if (filters_.empty()) return true;
    return std::any_of(filters_.begin(), filters_.end(), [can_id](const can_filter& filter) {
      const canid_t wanted = filter.can_id & ~CAN_INV_FILTER;
      const bool match = (can_id & filter.can_mask) == (wanted & filter.can_mask);
      return match != ((filter.can_id & CAN_INV_FILTER) != 0);
    });
  }

  std::span<const can_filter> filters() const noexcept { return filters_; }

 private:
  std::vector<can_filter> filters_;
};

}  // namespace hil::io::can
